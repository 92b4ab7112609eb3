"""Which shape is skipped?  The same ribbon, turned slowly and fast.

Slowly, U+S+ snaps to U+S-, rests there, and snaps to U-S+ at the second fold.  Fast, the clamp has passed the
second fold before the first snap has come to its end, and U+S- is never seen: skipping of type 2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import matplotlib.pyplot as plt

import compare
import der
from ribbonfem import Branch, History, Scene, kirchhoff
from ribbonfem.outcomes import classify


@dataclass(frozen=True)
class Result:
    """Two ramps.

    Attributes
    ----------
    folds: alpha_c1 and alpha_c2, rad.
    rates: rad/s; outcomes: of each; snaps: angles (rad) of the first and the second.
    motions: of each, by rods; curve: the states at rest, by elements.
    """

    folds: tuple[float, float]
    rates: tuple[float, ...]
    outcomes: tuple[str, ...]
    snaps: tuple[tuple[float, float], ...]
    motions: tuple[History, ...]
    curve: Branch


def main(
    *,
    compression: float = 0.40,
    shear: float = 0.40,
    rates: tuple[float, ...] = (0.05, 1.0),
    damping: float = 10.0,
    nodes: int = 51,
) -> Result:
    """Ramps from U+S+ through both folds."""
    # problem
    scene = Scene(compression=compression, shear=shear, start="U+S+", damping=damping, stop=0.9)

    # discretisation: folds and runs on the same mesh
    mesh: dict[str, Any] = {"nodes": nodes}

    # solver: adaptive steps, to the end of the ramp
    first, second = der.folds(scene, **mesh)

    # run
    motions = tuple(der.simulate(replace(scene, rate=rate), **mesh) for rate in rates)
    outcomes = [classify(motion, (first, second)) for motion in motions]

    return Result(
        folds=(first.angle, second.angle),
        rates=tuple(rates),
        outcomes=tuple(outcome.kind for outcome in outcomes),
        snaps=tuple(
            (
                outcome.first[1] if outcome.first else float("nan"),
                outcome.second[1] if outcome.second else float("nan"),
            )
            for outcome in outcomes
        ),
        motions=motions,
        curve=kirchhoff.equilibria(scene, elements=12, extensible=True, span=(-1.0, 0.9)),
    )


def look(result: Result) -> Any:
    """z(1/2) of both motions over the states at rest."""
    figure, axes = plt.subplots(figsize=(5.4, 3.6), constrained_layout=True)
    # importing `compare` gives a motion its `plot`
    assert compare
    for k, (motion, rate, kind) in enumerate(zip(result.motions, result.rates, result.outcomes, strict=True)):
        behind = result.curve if k == 0 else None
        motion.plot(axes, curve=behind, label=f"{rate:g} rad/s: {kind}")
    axes.set_xlim(-0.1, 0.9)
    axes.legend(frameon=False)
    return figure
