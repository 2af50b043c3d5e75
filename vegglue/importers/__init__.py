"""Folders of measurements as cases.

May import: case, measurements.
Open first: field_folder.py.
"""
