"""Compiled kernels of the quasi-linear beam in motion: banded matrices with one dense row."""
