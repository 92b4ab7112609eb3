"""Copies and sums of arrays in compiled code that allocate nothing."""

from __future__ import annotations

from ribbonfem.results import Array

from ..jit.decorator import compiled


@compiled()
def copy(source: Array, target: Array) -> None:
    """Put the entries of one contiguous array into another of the same shape."""
    for i in range(source.size):
        target.flat[i] = source.flat[i]


@compiled()
def add(source: Array, factor: float, target: Array) -> None:
    """Add a multiple of one contiguous array to another of the same shape."""
    for i in range(source.size):
        target.flat[i] += factor * source.flat[i]
