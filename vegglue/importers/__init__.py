"""Folders of measurements as cases.

A further layout is a file that makes the keys and values of a config, and a line in `workflow/import_folder.py`.

May import: case, measurements.
Open first: field_folder.py.
"""
