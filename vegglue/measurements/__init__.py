"""Measurements: read from files, checked for quality, and gathered in one table of stations.

May import: case, wording.
Open first: observations.py, kinds.py.
"""
