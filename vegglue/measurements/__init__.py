"""What was measured, read from files, judged, and brought into one table of stations.

May import: case, site.
Open first: observations.py, kinds.py.
"""
