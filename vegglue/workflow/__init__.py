"""The verbs of `import vegglue`, one file each: from a case to its results, kept in the folder of the run.

What draws is imported where a figure is drawn, so that what is up to date is told sooner.

May import: effects, case, site, measurements, flow, importers, engine, results, calibration, screening, storage,
ensemble, inference, diagnosis, discovery, figures, twins, report_page, checks, solver.
Open first: run.py, run_folder.py.
"""
