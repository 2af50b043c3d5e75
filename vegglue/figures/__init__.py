"""Figures: each draws plain arrays and knows nothing of where they come from.

May import: case, site, measurements, flow, results, screening, inference, diagnosis.
Open first: style.py, measured.py.
"""
