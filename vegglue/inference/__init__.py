"""From an ensemble and measurements to a posterior: GLUE, or draws around the best members by importance sampling.

May import: resistance, case, site, measurements, engine, results, calibration, screening.
Open first: glue.py, refine.py.
"""
