"""The shallow-water equations of a case: the problem, its residual, where water meets land, and what sensors read.

May import: resistance, effects, case, site, measurements.
Open first: problem.py, equations.py.
"""
