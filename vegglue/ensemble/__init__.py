"""All members of a case solved over the cores, or run by the command of its `engine`.

May import: case, site, measurements, flow, solver, results, storage, engine.
Open first: solve_ensemble.py, solve_chunk.py, command_ensemble.py.
"""
