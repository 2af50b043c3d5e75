"""Candidates for effects that a calibrated model lacks, their fingerprints, and score tests of the residual.

May import: effects, case, site, measurements, engine, calibration.
Open first: candidates.py, residual_screening.py.
"""
