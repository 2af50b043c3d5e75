"""The steps on files: check, the loop from misfit to a child config, and what every effect must keep.

May import: resistance, effects, case, site, measurements, flow, solver, engine, results, calibration, screening,
storage, diagnosis, report.
Open first: loop.py, check.py.
"""
