"""Folders of measurements as cases.

A further layout is a file that makes the keys and values of a config, and a line in `workflow/import_folder.py`. A
further instrument is a file with a reader (path, what the site file says of it) -> `MeasuredRows`, and its place in
`instruments.py`, or in `matlab_exports.py`; transects of a boat become stations in `transects.py`, verticals along a
tape in `tape_tables.py`, records of a probe their means in `point_records.py`. A new
ending stands among those of `instruments.py`, or of text in `measured_files.py`.

May import: case, measurements, wording.
Open first: field_folder.py, measured_files.py, instruments.py, column_names.py.
"""
