"""The law that is in no list: laws of a grammar against the misfit of a calibrated model, and the best as a file.

May import: effects, case, engine, calibration, screening, diagnosis.
Open first: search.py, discovered.py, effect_file.py.
"""
