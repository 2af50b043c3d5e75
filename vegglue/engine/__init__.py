"""What inference and diagnosis need of a flow model, and the engines that answer: `newton`, the
command of a user (`command`, `corrected`), a finished run of another model (`finished`), and `marching` for tests.

May import: case, effects, flow, measurements, results, wording.
Open first: interface.py, corrected.py.
"""
