"""A model brought to its best place: the errors of the data, least squares with exact slopes, the error of the grid.

May import: case, site, measurements, engine.
Open first: noise.py, fit.py.
"""
