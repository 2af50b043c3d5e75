"""Candidates for effects and laws that a calibrated model lacks, their fingerprints, score tests and evidence.

May import: effects, case, site, measurements, flow, engine, calibration.
Open first: candidates.py, residual_screening.py, evidence.py.
"""
