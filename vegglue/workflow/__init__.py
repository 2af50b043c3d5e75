"""The steps on files: the loop from misfit to a child config.

May import: effects, case, measurements, engine, results, calibration, screening, storage, diagnosis, report.
Open first: loop.py, run_folder.py.
"""
