"""The commands of the shell.

May import: effects, case, site, measurements, solver, results, storage, ensemble, inference, diagnosis, figures,
report, importers, twins, workflow.
Open first: main.py, options.py.
"""
