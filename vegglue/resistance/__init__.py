"""Laws of resistance: what a bed and what plants do to the water above them, in compiled loops.

May import: no other folder.
Open first: bed_laws.py, plant_laws.py.
"""
