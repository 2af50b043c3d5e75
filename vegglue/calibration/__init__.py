"""The calibration of a model: the covariance of all errors, least squares with exact slopes; candidate effects, their
fingerprints, score tests and evidence.

May import: case, effects, engine, flow, measurements, wording.
Open first: noise.py, model_error.py, fit.py, candidates.py, residual_screening.py.
"""
