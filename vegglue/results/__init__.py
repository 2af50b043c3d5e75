"""Results as values, and how each lies in a file: ensemble, fields, posterior, diagnosis.

May import: case, site, measurements, flow, solver.
Open first: ensemble.py, posterior.py.
"""
