"""The calibration of a model: the covariance of the errors, least squares with exact slopes, the error of the grid.

May import: case, site, measurements, engine.
Open first: noise.py, fit.py.
"""
