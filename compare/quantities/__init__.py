"""Quantities measured of any model (fold, snap, shape, energy), and their convergence in mesh and step."""
