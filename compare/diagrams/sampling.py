"""Adaptive sampling of a diagram: points inside each cell, and which cells get another round of runs.

A cell is an area in the coordinates of two axes, of rate and damping their logarithms.  In the first round
every cell gets a few points.  Those whose runs all agree with each other and with their neighbours are
sure; the others get more, and those that still disagree within themselves go on to the full number.  A
round is decided on whole earlier rounds, so that the order in which runs come back changes nothing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from scipy.optimize import linprog

from ribbonfem.results import Array

from .axes import Axis
from .setup import Sample

# runs of a cell after each round; beyond the last, twice as many
_ROUNDS = (3, 8, 16)
# of a 95 % interval
_NORMAL = 1.959963984540054


def rounds_up_to(samples: int) -> list[int]:
    """Runs that a cell has after each round, if it needs them all."""
    sizes = [size for size in _ROUNDS if size < samples]
    while sizes and 2 * sizes[-1] < samples and sizes[-1] >= _ROUNDS[-1]:
        sizes.append(2 * sizes[-1])
    return [*sizes, samples]


def cell_points(
    axes: tuple[Axis, Axis], cell: tuple[int, int], samples: int, seed: Sequence[int]
) -> list[tuple[float, float]]:
    """Values on both axes of a cell's runs, in their order.

    Parameters
    ----------
    cell: its number along each axis.
    samples: how many; 1 is the centre alone.
    seed: of the scrambling, its own for each cell.
    """
    centre = tuple(float(axis.values[k]) for axis, k in zip(axes, cell, strict=True))
    if samples == 1:
        return [(centre[0], centre[1])]
    # imported here: it takes a second, as much as all else that a worker imports
    from scipy.stats import qmc

    engine = qmc.Sobol(2, scramble=True, rng=np.random.default_rng(np.random.SeedSequence(list(seed))))
    shares = engine.random_base2(max(1, (samples - 1).bit_length()))[:samples]
    columns = [
        axis.moved(value, (share - 0.5) * axis.spacing)
        for axis, value, share in zip(axes, centre, shares.T, strict=True)
    ]
    return [(float(x), float(y)) for x, y in zip(*columns, strict=True)]


def majority(samples: Sequence[Sample]) -> str:
    """The most frequent outcome of the runs that ended; empty if none did."""
    counts = Counter(sample.outcome for sample in samples if sample.outcome)
    return max(sorted(counts), key=lambda name: counts[name]) if counts else ""


def agree(samples: Sequence[Sample]) -> bool:
    """Whether all runs that ended have one outcome."""
    return len({sample.outcome for sample in samples if sample.outcome}) <= 1


def unsure(cells: Sequence[Sequence[Sequence[Sample]]], first: bool) -> list[tuple[int, int]]:
    """Which cells (row, column) need another round.

    Parameters
    ----------
    cells: runs so far, by row and column.
    first: after the first round a cell that disagrees with a neighbour is unsure too.
    """
    rows, columns = len(cells), len(cells[0])
    names = [[majority(cell) for cell in row] for row in cells]
    result = []
    for j in range(rows):
        for i in range(columns):
            near = [
                names[b][a]
                for b, a in ((j - 1, i), (j + 1, i), (j, i - 1), (j, i + 1))
                if 0 <= b < rows and 0 <= a < columns
            ]
            apart = first and any(name and names[j][i] and name != names[j][i] for name in near)
            if apart or not agree(cells[j][i]):
                result.append((j, i))
    return result


def half_interval(count: int, total: int) -> float:
    """Half the 95 % interval of a share (E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209); NaN of no runs."""
    if total == 0:
        return float("nan")
    share, square = count / total, _NORMAL**2 / total
    return float(_NORMAL * np.sqrt(share * (1.0 - share) / total + square / (4.0 * total)) / (1.0 + square))


def _separable(one: Array, two: Array) -> bool:
    """Whether a line separates two sets of points (k, 2)."""
    rows = np.vstack((np.column_stack((one, np.ones(len(one)))), -np.column_stack((two, np.ones(len(two))))))
    result = linprog(np.zeros(3), A_ub=-rows, b_ub=-np.ones(len(rows)), bounds=[(None, None)] * 3)
    return bool(result.status == 0)


def name_of_cell(samples: Sequence[Sample], complete: bool, axes: tuple[Axis, Axis]) -> str:
    """What a cell is called.

    The common outcome where all runs agree; "cut" where one line in the coordinates separates two
    outcomes; "mixed" where none does and the cell has all the runs it may have; empty where no run ended.
    """
    done = [sample for sample in samples if sample.outcome]
    names = sorted({sample.outcome for sample in done})
    if len(names) <= 1:
        return names[0] if names else ""
    at = np.column_stack(
        [axis.coordinate([getattr(s, of) for s in done]) for axis, of in zip(axes, "xy", strict=True)]
    )
    places = [at[[s.outcome == name for s in done]] for name in names]
    every = np.vstack(places)
    centre, scale = every.mean(axis=0), np.maximum(np.ptp(every, axis=0), 1e-12)
    sets = [(points - centre) / scale for points in places]
    if len(sets) == 2 and _separable(*sets):
        return "cut"
    return "mixed" if complete else "cut"
