"""A case: what a YAML file may say, read, checked and hashed, and the priors of its parameters.

May import: effects.
Open first: schema.py, config.py.
"""
