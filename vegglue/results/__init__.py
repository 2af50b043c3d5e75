"""Results as values, and the files that hold them: ensemble, fields, posterior, diagnosis; locks, and how a killed run
resumes.

May import: case, effects, flow, measurements, wording.
Open first: verdict.py, diagnosis.py, ensemble.py, posterior.py, result_files.py.
"""
