"""Which shape is it in at the end?  The clamp stops between the two folds, and damping decides.

U+S- and U-S+ are both stable where it stops.  With strong damping the first snap ends in U+S-; with weak
damping it has energy left over, and passes on to U-S+.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import matplotlib.pyplot as plt

import der
from ribbonfem import History, Scene
from ribbonfem.outcomes import name_by_signs


@dataclass(frozen=True)
class Result:
    """Two held ramps.

    Attributes
    ----------
    folds: alpha_c1 and alpha_c2, rad; stop: between them.
    dampings: 1/s; last: the shape of each at the end; motions: of each.
    barrier: energy (EI2/L) of the saddle between U+S- and U- at the stop.
    energies: kinetic and elastic, of each run at its end.
    """

    folds: tuple[float, float]
    stop: float
    dampings: tuple[float, ...]
    last: tuple[str, ...]
    barrier: float
    energies: tuple[float, ...]
    motions: tuple[History, ...]


def main(
    *,
    compression: float = 0.40,
    shear: float = 0.40,
    stop: float = 0.36,
    rate: float = 1.0,
    dampings: tuple[float, ...] = (10.0, 0.1),
    hold: float = 80.0,
    nodes: int = 51,
) -> Result:
    """Ramps from U+S+ that stop between the folds."""
    # problem
    scene = Scene(compression=compression, shear=shear, start="U+S+", rate=rate, stop=stop, hold=hold)

    # discretisation
    mesh: dict[str, Any] = {"nodes": nodes}

    # solver: the hold ends once the energy is below every barrier, for then nothing changes any more
    options: dict[str, Any] = {**mesh, "until": "decided"}

    # run
    first, second = der.folds(replace(scene, stop=None), **mesh)
    barrier = der.saddle(scene, stop, **mesh).energy
    motions = tuple(der.simulate(replace(scene, damping=damping), **options) for damping in dampings)

    return Result(
        folds=(first.angle, second.angle),
        stop=stop,
        dampings=tuple(dampings),
        last=tuple(name_by_signs(motion.height[-1], motion.slope[-1]) for motion in motions),
        barrier=barrier,
        energies=tuple(
            float(motion.energies["kinetic"][-1] + motion.energies["elastic"][-1]) for motion in motions
        ),
        motions=motions,
    )


def look(result: Result) -> Any:
    """z(1/2) over time, and the energy beside the barrier."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.6, 3.2), constrained_layout=True)
    for motion, damping, last in zip(result.motions, result.dampings, result.last, strict=True):
        left.plot(motion.time, motion.height, label=f"{damping:g}/s: {last}", lw=1.0)
        right.plot(motion.time, motion.energies["kinetic"] + motion.energies["elastic"], lw=1.0)
    left.axhline(0.0, color="0.6", lw=0.9)
    left.set(xlabel="time (s)", ylabel="$z(1/2)/L$")
    left.legend(frameon=False, title="damping")
    right.axhline(result.barrier, color="0.3", lw=0.9, ls="--", label="saddle to U-")
    right.set(xlabel="time (s)", ylabel="energy ($EI_2/L$)")
    right.legend(frameon=False)
    return figure
