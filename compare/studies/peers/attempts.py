"""Runs of the same scenes in this package and in other programs, timed by turns."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import der
from compare.external import auto as peer_auto
from compare.external import exudyn as peer_exudyn
from compare.external import pyelastica as peer_pyelastica
from compare.limits import edge_ratio, two_point
from compare.studies import study
from compare.studies.study import Study
from compare.sweep import Sweep
from ribbonfem import History, Scene, SolverError, elastica, kirchhoff
from ribbonfem.results import Array

# both ramps stop just after the snap, so that no code pays for the ringing that follows
PLANAR = Scene(compression=0.40, shear=0.0, start="U+", rate=0.1, damping=1.0, stop=1.165)
RIBBON = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.1, damping=1.0, stop=0.612)
BRANCH = Scene(compression=0.40, shear=0.40, start="U+S+")
FOLDS = 4
# the error in the angle of the planar snap (rad) at which codes are compared
ERROR = 1e-4
# nodes of the discrete rods
RODS = (51, 101, 201)
Go = Callable[[], tuple[float, float]]


@dataclass(frozen=True)
class Timing:
    """A code on a scene: error (rad), CPU seconds, and their ratio to the first's (least, median, most)."""

    code: str
    resolution: str
    step: str
    error: float | None = None
    seconds: float | None = None
    ratio: tuple[float | None, float, float | None] | None = None
    note: str = ""

    @property
    def done(self) -> bool:
        """Whether it came to an end with the answer asked for."""
        return self.error is not None

    @property
    def off(self) -> float:
        """The size of the error; infinite without an answer."""
        return float("inf") if self.error is None else abs(self.error)


class Attempt:
    """One way to do a scene: what `go` returns is its error and its CPU seconds; and what came of it."""

    def __init__(self, code: str, resolution: str, step: str, go: Go, **known: Any) -> None:
        self.go, self.timing = go, Timing(code, resolution, step, **known)

    def once(self) -> None:
        """Attempt, and keep the error and the CPU seconds, or how it failed."""
        try:
            error, seconds = self.go()
            self.keep(error=error, seconds=seconds)
        except SolverError as failure:
            # the table has room for one line
            self.keep(note=str(failure).splitlines()[0][:110])

    def keep(self, **result: Any) -> None:
        """Keep what was found besides."""
        self.timing = replace(self.timing, **result)


def attempted(title: str, runs: Sequence[Attempt], sweep: Sweep) -> Sequence[Attempt]:
    """The runs, each attempted once."""
    Study(title, Attempt.once, runs).results(sweep)
    return runs


def alternate(runs: Sequence[Attempt], rounds: int, sweep: Sweep) -> Array:
    """Time runs by turns; they keep their median CPU seconds and the ratios to the first of them.

    Returns the CPU seconds (rounds, runs).
    """
    turns = Study("by turns", lambda run: run.go()[1], runs).by_turns(sweep, rounds)
    taken = np.array(turns, dtype=float).T
    for run, seconds, ratio in zip(runs, taken.T, (taken / taken[:, :1]).T, strict=True):
        least, middle, most = float(ratio.min()), float(np.median(ratio)), float(ratio.max())
        run.keep(seconds=float(np.median(seconds)), ratio=(least, middle, most))
    return taken


def cheapest(runs: Sequence[Attempt], error: float = ERROR) -> Attempt | None:
    """The cheapest of the runs whose error is at most `error`; None if there is none."""
    return study.cheapest(((run, run.timing.off) for run in runs), lambda run: run.timing.seconds, error)


def settled(runs: Sequence[Attempt], error: float = ERROR) -> Attempt | None:
    """The cheapest run whose error, and that of all finer ones with the same note, is at most `error`."""

    def size(run: Attempt) -> tuple[float, float]:
        return -float(run.timing.resolution.split()[0]), float(run.timing.step.split()[0])

    kept = study.settled(runs, lambda run: run.timing.off, lambda run: run.timing.note, size)
    return study.cheapest(kept, lambda run: run.timing.seconds, error)


def _angle(history: History) -> float:
    """The angle at which z(1/2) = 0."""
    result = history.crossing()
    if result is None:
        raise SolverError("z(1/2) did not change sign")
    return result[1]


def _ours(simulate: Callable[..., History], truth: float, **options: Any) -> Go:
    def go() -> tuple[float, float]:
        begin = time.process_time()
        error = _angle(simulate(**options)) - truth
        # of the whole call, which sets the problem up too: to our disadvantage
        return error, time.process_time() - begin

    return go


def _theirs(simulate: Callable[..., History], truth: float, **options: Any) -> Go:
    def go() -> tuple[float, float]:
        history = simulate(**options)
        return _angle(history) - truth, float(history.stats["seconds"])

    return go


def planar_truth(extensible: bool = True, elements: int = 24, step: float = 1e-3) -> float:
    """Angle of the planar snap, from two fixed steps of the elastica, extrapolated."""
    options: dict[str, Any] = {"elements": elements, "extensible": extensible, "method": "tr-bdf2"}
    coarse, fine = (
        _angle(elastica.simulate(PLANAR, until="snap", step=size, **options)) for size in (2.0 * step, step)
    )
    return two_point(coarse, fine, 4.0)


def ribbon_truth(nodes: int = 101, tolerance: float = 1e-5) -> float:
    """Angle of the ribbon's snap, from two meshes of `der` extrapolated."""
    meshes = nodes, 2 * nodes - 1
    coarse, fine = (
        _angle(der.simulate(RIBBON, nodes=n, tolerance=tolerance, configurations=False)) for n in meshes
    )
    return two_point(coarse, fine, edge_ratio(*meshes))


def elastica_runs(
    truth: float, extensible: bool, choices: Sequence[tuple[int, float | None]]
) -> list[Attempt]:
    """The elastica on these meshes and tolerances (None: the default)."""
    code = "elastica FEM, EA" if extensible else "elastica FEM"
    given: dict[str, Any] = {
        "scene": PLANAR,
        "extensible": extensible,
        "until": "snap",
        "configurations": False,
    }
    return [
        Attempt(
            code,
            f"{elements} elements",
            "default" if tolerance is None else f"tol {tolerance:g}",
            _ours(elastica.simulate, truth, elements=elements, tolerance=tolerance, **given),
        )
        for elements, tolerance in choices
    ]


def kirchhoff_runs(scene: Scene, truth: float, choices: Sequence[tuple[int, float | None]]) -> list[Attempt]:
    """The elements in three dimensions, with EA, on these meshes and tolerances (None: the default)."""
    given: dict[str, Any] = {"scene": scene, "extensible": True, "until": "snap", "configurations": False}
    return [
        Attempt(
            "Kirchhoff FEM",
            f"{elements} elements",
            "default" if tolerance is None else f"tol {tolerance:g}",
            _ours(kirchhoff.simulate, truth, elements=elements, tolerance=tolerance, **given),
        )
        for elements, tolerance in choices
    ]


def rod_runs(scene: Scene, truth: float) -> list[Attempt]:
    """The rods with their default steps."""
    given: dict[str, Any] = {"scene": scene, "configurations": False}
    return [
        Attempt("DER", f"{n} nodes", "default", _ours(der.simulate, truth, nodes=n, **given)) for n in RODS
    ]


def exudyn_planar_runs(truth: float) -> list[Attempt]:
    """Exudyn's geometrically exact 2D beam on a grid of meshes, steps and shear stiffnesses."""
    # a Newton tolerance of 1e-4 makes it a third quicker than its default and costs no accuracy
    given: dict[str, Any] = {"scene": PLANAR, "newton_tolerance": 1e-4}
    return [
        Attempt(
            "Exudyn",
            f"{elements} quadratic",
            f"{step:g} s",
            _theirs(peer_exudyn.simulate, truth, elements=elements, step=step, shear=shear, **given),
            note=f"shear {shear:g} EA",
        )
        for shear in (10.0, 100.0)
        for elements in (12, 16, 20, 24, 32)
        for step in (2e-2, 1e-2, 5e-3)
    ]


def exudyn_ribbon_runs(truth: float) -> list[Attempt]:
    """Exudyn's geometrically exact 3D beam."""
    given: dict[str, Any] = {"scene": RIBBON, "step": 1e-2, "shear": 1.0, "newton_tolerance": 1e-5}
    return [
        Attempt(
            "Exudyn",
            f"{elements} linear",
            "0.01 s",
            _theirs(peer_exudyn.simulate, truth, elements=elements, modified_newton=modified, **given),
            note="" if modified else "full Newton",
        )
        for elements, modified in ((40, True), (40, False), (80, False))
    ]


def pyelastica_runs(scene: Scene, truth: float, choices: Sequence[tuple[int, float]]) -> list[Attempt]:
    """PyElastica on these meshes and steps (s)."""
    return [
        Attempt(
            "PyElastica",
            f"{nodes} nodes",
            f"{step:g} s",
            _theirs(peer_pyelastica.simulate, truth, scene=scene, nodes=nodes, step=step),
        )
        for nodes, step in choices
    ]


def branch_runs(program: peer_auto.Auto | None) -> list[Attempt]:
    """The static branch by elements, and by AUTO where there is a `program`."""
    truth = [fold.angle for fold in kirchhoff.equilibria(BRANCH, elements=48).folds[:FOLDS]]

    def worst(angles: Sequence[float]) -> float:
        return float(np.abs(np.array(angles[:FOLDS]) - truth).max())

    def ours(elements: int, unstable: int) -> Go:
        def go() -> tuple[float, float]:
            begin = time.process_time()
            folds = kirchhoff.equilibria(BRANCH, elements=elements, unstable=unstable).folds
            return worst([fold.angle for fold in folds]), time.process_time() - begin

        return go

    runs = [
        Attempt("kirchhoff FEM", f"{elements} elements", "default", ours(elements, unstable), note=note)
        for elements, unstable, note in (
            (18, 1, "four folds, both ways from the start"),
            (20, 1, "the same"),
            (18, 2, "seven folds"),
            (20, 2, "seven folds"),
        )
    ]
    if program is None:
        return runs

    def theirs(**options: Any) -> Go:
        def go() -> tuple[float, float]:
            result = program.run(folds=FOLDS, **options)
            return worst(result.folds), result.seconds

        return go

    return runs + [
        Attempt("AUTO-07p", f"{n} x 4", f"DSMAX {most:g}", theirs(intervals=n, largest=most))
        for n, most in ((25, 2.5), (25, 2.0), (50, 1.5), (25, 5.0))
    ]
