"""The library of physical effects, one file for each stage at which an effect may act, and the laws of resistance of
beds and plants, in compiled loops.

May import: no other folder.
Open first: definition.py, library.py, bed_laws.py, plant_laws.py.
"""
