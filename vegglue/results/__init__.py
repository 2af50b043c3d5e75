"""Results as values, and the files that hold them: ensemble, fields, posterior, diagnosis; locks, and how a killed run
resumes.

May import: case, effects, flow, measurements, wording.
Open first: ensemble.py, posterior.py, diagnosis.py, result_files.py.
"""
