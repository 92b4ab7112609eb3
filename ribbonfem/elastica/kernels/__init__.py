"""Compiled kernels of the elastica in motion: the plane's mixed form, four elements at a time."""
