"""Compiled linear algebra: symmetric banded matrices with a border, array operations."""
