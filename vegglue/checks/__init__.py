"""What is odd about a case, in sentences, and what every effect must keep, tried in a small channel.

May import: resistance, effects, case, site, measurements, flow, solver, results.
Open first: case_check.py, effect_contract.py.
"""
