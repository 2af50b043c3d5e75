"""From misfit to missing effect: screening, refits, the verdict, the next measurement, and models side by side.

May import: effects, case, site, measurements, flow, engine, results, calibration, screening, inference.
Open first: diagnose.py, competition.py, verdict.py.
"""
