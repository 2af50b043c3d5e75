"""The verbs of `import vegglue`, one file each: from a case to its results, kept in the folder of the run; twins with a
hidden effect.

What draws is imported where a figure is drawn, so that results that are up to date are shown sooner.

May import: calibration, case, diagnosis, effects, engine, flow, importers, inference, measurements, pages, results,
wording.
Open first: run.py, case_run.py.
"""
