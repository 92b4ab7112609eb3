"""The output of the time loop of a planar beam, and how it becomes a `History` in a user's units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ribbonfem.frozen import Frozen, freeze
from ribbonfem.results import Array, History, RestState, SolverError, control_text
from ribbonfem.rows import Rows, reactions_in, shapes_of
from ribbonfem.scene import Scene

from .kernels import KEPT, REACTIONS

ENERGIES = ("kinetic", "elastic", "potential", "dissipated", "work")


@dataclass(frozen=True)
class Motion:
    """What the time loop hands back, in t* and the beam's own units.

    Attributes
    ----------
    rows: with the columns of the time loop, slopes, and where configurations are kept positions (rows,
        nodes, 3) in L, curvature (rows, nodes) in 1/L and velocities (rows, nodes, 3) in L/t*.
    stats: as in `History`.
    problem: why the end was not reached, a sentence; empty if it was.
    resume: what the model's stepper goes on from.
    rings: whether velocities ring from step to step, so that they are not told.
    """

    rows: Rows
    stats: dict[str, float]
    problem: str
    resume: Mapping[str, Array]
    rings: bool

    def as_history(
        self,
        scene: Scene,
        options: Mapping[str, Any],
        *,
        model: str,
        arclength: Array,
        length: float = 1.0,
        initial: RestState | History | None = None,
        rest: Mapping[str, Array] | None = None,
    ) -> History:
        """The motion in the units of `History`; `length` is the beam's own unit of height, in L.

        `initial` is what it began with, if not the scene's start, and `rest` that of the `History`.

        Raises
        ------
        SolverError
            If the end was not reached; its `history` is what was.
        """
        second = scene.ribbon.inertial_time
        units = (second, 1.0, length, *(length**2,) * 5, 1.0, math.nan if self.rings else length / second)
        taken, steps = self.rows.taken(dict(enumerate(units)))
        reactions = reactions_in(taken[0], REACTIONS, initial)
        whole, *shapes = taken
        freeze(whole)
        time, angle, height, *energies, load, velocity = whole.T[:KEPT]
        history = History(
            time=time,
            control=angle,
            height=height,
            slope=whole[:, -1],
            energies=Frozen(zip(ENERGIES, energies, strict=True)),
            configurations=shapes_of(shapes, "curvature", math.nan if self.rings else 1.0 / second),
            load=load,
            arclength=arclength,
            velocity=velocity,
            stats=self.stats | self.rows.stats,
            scene=scene,
            options=options,
            model=model,
            steps=freeze(steps),
            resume=self.resume,
            reactions=reactions,
            rest=rest,
        )
        if self.problem:
            where = f"t = {history.time[-1]:.6g} s, {control_text(scene, history.control[-1])}"
            raise SolverError(f"{model}: stopped at {where}: {self.problem}", history)
        return history
