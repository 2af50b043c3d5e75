"""What inference and diagnosis ask of a flow model, and the engines that answer: `newton`, the
command of a user (`command_run`, `corrected`), and `marching` for tests.

May import: effects, case, site, measurements, flow, solver, storage.
Open first: interface.py, newton.py, corrected.py.
"""
