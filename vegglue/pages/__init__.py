"""Figures and pages. Figures draw plain arrays; the page of a run sets them beside the words of `wording`.

May import: calibration, case, diagnosis, effects, flow, inference, measurements, results, wording.
Open first: style.py, page.py.
"""
