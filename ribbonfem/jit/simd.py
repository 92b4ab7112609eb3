"""SIMD numbers: one value of compiled code holds a number of each of four elements.

What is the same for every element of a mesh, one after the other, is done for four at once:
`+ - * /` act on each of the four, or on all with one float.  The compiler does not have to find
that out by itself: the type is the processor's own vector (or what serves for it), whatever
surrounds it.  Arrays of such values are contiguous float arrays whose last axis has `WIDTH` entries.
"""

from __future__ import annotations

from typing import Any

from numba import config

from ribbonfem.results import Array

from . import simd_arrays, simd_vectors
from .decorator import compiled

_numbers: Any = simd_arrays if config.DISABLE_JIT else simd_vectors

WIDTH = simd_arrays.WIDTH
load, store, spread = _numbers.load, _numbers.store, _numbers.spread
load_from, store_from = _numbers.load_from, _numbers.store_from
transposed, lane = _numbers.transposed, _numbers.lane
all_below, larger = _numbers.all_below, _numbers.larger
root, nearest = _numbers.root, _numbers.nearest


@compiled(inline=True)
def increase(array: Array, indices: tuple[int, ...], value: Any) -> None:
    """array[*indices, :] += value."""
    store(array, indices, load(array, indices) + value)


@compiled(inline=True)
def summed(value: Any) -> float:
    """The four of a value together."""
    return (lane(value, 0) + lane(value, 1)) + (lane(value, 2) + lane(value, 3))


@compiled(inline=True)
def greatest(value: Any) -> float:
    """The largest of the four of a value of which none is below 0."""
    most = 0.0
    for place in range(WIDTH):
        most = max(most, lane(value, place))
    return most
