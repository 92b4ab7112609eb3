"""Compiled linear algebra of the hot loops."""
