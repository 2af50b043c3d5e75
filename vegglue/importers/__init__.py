"""Folders of measurements as cases.

A further layout is a file that makes the keys and values of a config, and a line in `workflow/import_folder.py`. A
further instrument is a file that reads its export, and a line in `instruments.py`, or in `matlab_exports.py`.

May import: case, site, measurements.
Open first: field_folder.py, measured_files.py, column_names.py.
"""
