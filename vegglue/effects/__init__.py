"""The library of physical effects: what one is, what it gets to see, and one file for each stage it may act at.

May import: resistance.
Open first: definition.py, library.py.
"""
