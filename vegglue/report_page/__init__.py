"""The page about a run: its words, tables and figures.

May import: effects, case, site, measurements, flow, solver, results, screening, inference, figures.
Open first: page.py, findings.py.
"""
