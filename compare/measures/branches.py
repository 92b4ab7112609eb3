"""Where a curve of equilibria goes from its start."""

from __future__ import annotations

import numpy as np

from ribbonfem import Branch


def outward(branch: Branch, sign: float = 1.0) -> slice:
    """Rows of a curve from its start on, in the sense in which alpha first goes to this sign.

    The start may be met on the curve in either sense.
    """
    first = int(np.flatnonzero(branch.angle == 0.0)[0])
    forth = first + 1 < len(branch) and sign * branch.angle[first + 1] > 0.0
    return slice(first, None) if forth else slice(first, None, -1)
