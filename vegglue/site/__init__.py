"""The site of a case on its grid: bed levels, friction classes, patches of plants, and the channel they make.

May import: effects, case.
Open first: gridded_site.py, channel_geometry.py.
"""
