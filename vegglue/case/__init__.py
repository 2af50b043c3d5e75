"""A case: the YAML file, read, checked and hashed, the priors of its parameters, and its site on the grid.

May import: effects, wording.
Open first: schema.py, config.py, gridded_site.py.
"""
