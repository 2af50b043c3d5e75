"""What inference and diagnosis ask of a flow model, and the engines that answer: `newton`, and `marching` for tests.

May import: effects, case, site, measurements, flow, solver.
Open first: interface.py, newton.py.
"""
