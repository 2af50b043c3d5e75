"""The shallow-water equations of a case and their steady states: Newton for one member, chord steps for its neighbours,
marching if both fail; tangents, adjoints and sensors.

May import: case, effects, measurements.
Open first: problem.py, equations.py, newton.py, batch.py.
"""
