"""Results on disk: HDF5 files, one run at a time, and how a killed run resumes.

May import: case, site, flow, results.
Open first: result_files.py, resume.py.
"""
