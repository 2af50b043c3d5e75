"""From misfit to missing effect: checks of a case, screening, refits, the verdict, the next measurement, laws outside
the library, and models side by side.

May import: calibration, case, effects, engine, flow, inference, measurements, results, wording.
Open first: diagnose.py, competition.py, conclusion.py, case_check.py.
"""
