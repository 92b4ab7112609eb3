"""Strategies for one number of a scene, each a class with `run`, and the `Answer` that comes of it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ribbonfem import History, Scene, SolverError
from ribbonfem.frozen import html_table, short_options
from ribbonfem.results import Value

from . import at_rest, levels, predicted, refinement
from .cost_laws import shipped
from .refinement import Run, Settled


@dataclass(frozen=True, repr=False, eq=False)
class Answer(Value):
    """One number of a scene, and what may be wrong with it.

    Attributes
    ----------
    value: of the control (rad of clamps), or s of "snap time"; None where the ribbon does not snap.
    error: estimated, alike.
    met: whether `error` is within the tolerance asked for.
    sensitive: refinement does not settle the value: no single run decides it.
    seconds: CPU, of all runs.
    runs: what was run, in order; empty where a prediction was enough.
    history: of the finest run, or None.
    unit: of the value.
    """

    value: float | None
    error: float
    met: bool
    sensitive: bool
    seconds: float
    runs: tuple[Run, ...]
    history: History | None
    unit: str = "rad"

    def __repr__(self) -> str:
        result = "no snap" if self.value is None else f"{self.value:.9g}, error {self.error:.1e}"
        kept = "sensitive" if self.sensitive else f"tolerance {'met' if self.met else 'not met'}"
        return f"Answer({result}, {kept}; {len(self.runs)} runs, {self.seconds:.3g} s)"

    def _repr_html_(self) -> str:
        rows = [(run.model, short_options(run.options), run.value, run.seconds) for run in self.runs]
        return html_table(repr(self), ("model", "options", f"value ({self.unit or 1})", "CPU s"), rows)


@dataclass(frozen=True, repr=False, eq=False)
class Choice(Value):
    """The cheapest way to a number that meets a tolerance; its kinds differ in what `run` does.

    Attributes
    ----------
    scene, quantity, tolerance, motion: what was asked.
    model: "prediction" (no run), "elastica", "kirchhoff" or "folds" (a ribbon's fold and
        its predicted delay).
    options: of the run, or of the first of several.
    estimate: expected error, in the value's unit.
    seconds: expected CPU seconds, on the machine that measured the laws.
    reason: in words.
    value: of a prediction, or None; None for all else.
    """

    scene: Scene
    quantity: str
    tolerance: float
    model: str
    options: Mapping[str, Any]
    estimate: float
    seconds: float
    reason: str
    value: float | None = None
    motion: bool = False

    @property
    def unit(self) -> str:
        """Of the value: s of a time, else the control's."""
        return "s" if self.quantity == "snap time" else self.scene.drives.unit

    def __repr__(self) -> str:
        value = "" if self.value is None else f", {self.value:.9g} {self.unit}".rstrip()
        wanted = f"{self.tolerance:g} {self.unit}".rstrip()
        return (
            f"Choice({self.model!r}{value} for {self.quantity!r} to {wanted}; expected error "
            f"{self.estimate:.1e}, {self.seconds:.2g} s;\n  {self.reason})"
        )

    def run(self) -> Answer:
        """Do what was chosen.

        Raises
        ------
        SceneError, SolverError
            As the model does: for a start that is no stable equilibrium, a run that fails.
        """
        begin = time.process_time()
        settled = self.settle()
        met = not settled.sensitive and settled.error <= self.tolerance
        seconds = time.process_time() - begin
        found = settled.value, settled.error, met, settled.sensitive
        return Answer(*found, seconds, settled.runs, settled.history, self.unit)

    def settle(self) -> Settled:
        """The number, its error, and what was run for it."""
        raise NotImplementedError


class Known(Choice):
    """Known without a run."""

    def settle(self) -> Settled:
        """What is known."""
        return Settled(self.value, self.estimate, False, (), None)


class AtRest(Choice):
    """The last fold of finite elements, refined until meshes agree."""

    def settle(self) -> Settled:
        """Refine."""
        of: Callable[..., Any] = levels.MODELS[self.model].folds
        value, error, runs, _ = at_rest.folds(self.model, of, self.scene, self.tolerance)
        return Settled(value, error, False, runs, None)


class Elements(Choice):
    """A scene in motion by elements on finer and finer meshes; rods after all where the elements fail."""

    def settle(self) -> Settled:
        """Refine."""
        laws, motion = shipped(), self.motion

        def elements(scene: Scene) -> Settled:
            return levels.elements(scene, self.quantity, self.tolerance, configurations=motion)

        def rods(scene: Scene) -> Settled:
            return refinement.rods(
                scene, self.quantity, self.tolerance, laws.ribbon, first=1, configurations=motion
            )

        try:
            return refinement.stopped(self.scene, elements, self.quantity)
        except SolverError:
            return refinement.stopped(self.scene, rods, self.quantity)


class Slow(Elements):
    """A ribbon's last fold and the delay behind it; a run after all where they make no snap certain."""

    def settle(self) -> Settled:
        """Predict, else refine."""
        return predicted.answer(self.scene, self.tolerance) or super().settle()
