"""Synthetic measurements with a hidden effect, and how well a diagnosis guessed it.

May import: resistance, effects, case, site, measurements, engine, results, calibration, screening, diagnosis.
Open first: twin.py, hidden_effect.py.
"""
