"""The calibration of a model: the covariance of all errors, least squares with exact slopes, errors of grid and model.

May import: case, site, measurements, flow, engine.
Open first: noise.py, model_error.py, fit.py.
"""
