"""What inference and diagnosis need of a flow model, and the engines: `newton`, the command of a user (`command`,
`corrected`), and a finished run of another model (`finished`).

May import: case, effects, flow, measurements, results, wording.
Open first: interface.py, corrected.py.
"""
