"""All members of a case solved over the cores.

May import: case, site, measurements, flow, solver, results, storage, engine.
Open first: solve_ensemble.py.
"""
