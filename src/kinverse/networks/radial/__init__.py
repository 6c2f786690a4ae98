"""Gaussian units and the choice of their centres: what the radial networks are made of."""
