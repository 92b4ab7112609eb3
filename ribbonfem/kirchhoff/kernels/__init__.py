"""Compiled code of the Kirchhoff rod, at rest and in motion."""
