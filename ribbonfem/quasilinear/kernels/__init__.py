"""Compiled kernels of the quasi-linear beam in motion: symmetric bands, factors kept, and a border."""
