"""The commands of the shell.

May import: effects, case, site, measurements, results, storage, ensemble, inference, diagnosis, figures, report,
importers, twins, checks, workflow.
Open first: main.py, options.py.
"""
