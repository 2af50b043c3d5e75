"""From priors to a posterior: the members of an ensemble, solved or run by a command; GLUE, or importance sampling of
the model or of a surrogate of a command.

May import: calibration, case, effects, engine, flow, measurements, results, wording.
Open first: solve_ensemble.py, glue.py, refine.py, surrogate.py.
"""
