"""What inference and diagnosis ask of a flow model: predictions, slopes, answers to a cause, adjoints.

May import: effects, case, site, measurements, flow, solver.
Open first: linearised_model.py, forward_runs.py.
"""
