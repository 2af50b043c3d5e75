"""The verbs of `import vegglue`, one file each: from a case to its results, kept in the folder of the run.

May import: effects, case, site, measurements, flow, importers, engine, results, calibration, screening, storage,
ensemble, inference, diagnosis, figures, twins, report_page, checks.
Open first: run.py, run_folder.py.
"""
