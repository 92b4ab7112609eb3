"""Compiled kernels of the elastica: mixed elements in the plane, four of them at a time."""
