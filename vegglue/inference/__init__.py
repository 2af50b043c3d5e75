"""From priors to a posterior: all members of an ensemble solved over the cores or run by a command; GLUE, or draws
around the best members by importance sampling, of the model or of a surrogate of a command.

May import: calibration, case, effects, engine, flow, measurements, results, wording.
Open first: solve_ensemble.py, glue.py, refine.py, surrogate.py.
"""
