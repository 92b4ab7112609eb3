"""Tables of a mesh's elements in groups of four, for SIMD (`jit.simd`).

Arrays of groups have an axis of them first and one of `WIDTH` elements last; places without an
element repeat the last one, so that nothing there is ever singular.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ribbonfem.jit.simd import WIDTH
from ribbonfem.results import Array

OPTIONS: dict[str, Any] = {"fastmath": {"contract", "reassoc", "nsz"}}
# of what is called for an element, a point or a node: to hand over these tuples costs more than its work
INLINED: dict[str, Any] = {**OPTIONS, "inline": True}


def groups_of(elements: int) -> int:
    """How many groups of `WIDTH` hold so many elements."""
    return -(-elements // WIDTH)


def in_groups(table: Array) -> Array:
    """A table (E, ...) as (G, ..., WIDTH)."""
    elements = len(table)
    which = np.minimum(np.arange(WIDTH * groups_of(elements)), elements - 1)
    groups = table[which].reshape(-1, WIDTH, *table.shape[1:])
    return np.ascontiguousarray(groups.transpose(0, *range(2, groups.ndim), 1))
