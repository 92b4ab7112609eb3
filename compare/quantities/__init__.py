"""Quantities of a scene, and their convergence in mesh and step."""
