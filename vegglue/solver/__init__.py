"""Steady states of the flow: Newton for one member, chord steps for its neighbours, marching where both fail;
tangents and adjoints.

May import: resistance, flow.
Open first: newton.py, batch.py.
"""
