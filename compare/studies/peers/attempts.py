"""The ways in which each program does the same scenes, and what they take by turns."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import der
from compare.external import auto as peer_auto
from compare.external import exudyn as peer_exudyn
from compare.external import pyelastica as peer_pyelastica
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


@dataclass
class Attempt:
    """One way to do a scene: what `go` returns is its error and its CPU seconds."""

    code: str
    resolution: str
    step: str
    go: Callable[[], tuple[float, float]]
    error: float | None = None
    seconds: float | None = None
    ratio: tuple[float | None, float, float | None] | None = None
    note: str = ""

    def once(self) -> float | None:
        """Attempt, and keep the error and the CPU seconds, or how it failed."""
        try:
            self.error, self.seconds = self.go()
        except SolverError as error:
            # the table has room for one line
            self.note = str(error).splitlines()[0][:110]
        return self.seconds

    def timing(self) -> Timing:
        """What came of it."""
        return Timing(self.code, self.resolution, self.step, self.error, self.seconds, self.ratio, self.note)


@dataclass(frozen=True)
class Timing:
    """A code on a scene: error (rad), CPU seconds, and their ratio to the first's (least, median, most)."""

    code: str
    resolution: str
    step: str
    error: float | None
    seconds: float | None
    ratio: tuple[float | None, float, float | None] | None
    note: str

    @property
    def done(self) -> bool:
        """Whether it came to an end with the answer asked for."""
        return self.error is not None

    def row(self) -> list[Any]:
        """A row of a table."""
        ratio = self.ratio or (None, None, None)
        return [self.code, self.resolution, self.step, self.error, self.seconds, *ratio, self.note]


def alternate(runs: Sequence[Attempt], rounds: int) -> Array:
    """Time runs by turns and keep their CPU seconds (median) and their ratios to the first of them.

    By turns, so that what else the machine does meets all of them alike.  Returns the CPU seconds
    (rounds, runs).
    """
    taken = np.array([[run.go()[1] for run in runs] for _ in range(rounds)])
    for k, run in enumerate(runs):
        ratio = taken[:, k] / taken[:, 0]
        run.seconds = float(np.median(taken[:, k]))
        run.ratio = (float(ratio.min()), float(np.median(ratio)), float(ratio.max()))
    return taken


def _snap(history: History, truth: float) -> float:
    """Error of the angle at which z(1/2) = 0."""
    found = history.crossing()
    if found is None:
        raise SolverError("z(1/2) did not change sign")
    return found[1] - truth


def _ours(simulate: Callable[..., History], truth: float, **policy: Any) -> Callable[[], tuple[float, float]]:
    def go() -> tuple[float, float]:
        begin = time.process_time()
        history = simulate(**policy)
        # of the whole call, which sets the problem up too: to our disadvantage
        return _snap(history, truth), time.process_time() - begin

    return go


def _theirs(
    simulate: Callable[..., History], truth: float, **policy: Any
) -> Callable[[], tuple[float, float]]:
    def go() -> tuple[float, float]:
        history = simulate(**policy)
        return _snap(history, truth), float(history.stats["seconds"])

    return go


def planar_truth(extensible: bool = True, elements: int = 24, step: float = 1e-3) -> float:
    """Angle of the planar snap, from two fixed steps of the elastica, extrapolated."""
    coarse, fine = (
        elastica.simulate(
            PLANAR, elements=elements, extensible=extensible, method="tr-bdf2", until="snap", step=size
        ).crossing()
        for size in (2.0 * step, step)
    )
    if coarse is None or fine is None:
        raise SolverError("the reference run did not snap")
    return (4.0 * fine[1] - coarse[1]) / 3.0


def ribbon_truth(nodes: int = 101, tolerance: float = 1e-5) -> float:
    """Angle of the ribbon's snap, from two meshes of `der` extrapolated."""
    dense = 2 * nodes - 1
    coarse, fine = (
        der.simulate(RIBBON, nodes=n, tolerance=tolerance, configurations=False).crossing()
        for n in (nodes, dense)
    )
    if coarse is None or fine is None:
        raise SolverError("the reference run did not snap")
    ratio = ((dense - 2) / (nodes - 2)) ** 2
    return (ratio * fine[1] - coarse[1]) / (ratio - 1.0)


def elastica_runs(
    truth: float, extensible: bool, choices: Sequence[tuple[int, float | None]]
) -> list[Attempt]:
    """The elastica on these meshes and tolerances (None: the default)."""
    runs = []
    for elements, tolerance in choices:
        go = _ours(
            elastica.simulate,
            truth,
            scene=PLANAR,
            elements=elements,
            extensible=extensible,
            tolerance=tolerance,
            until="snap",
        )
        step = "default" if tolerance is None else f"tol {tolerance:g}"
        code = "elastica FEM, EA" if extensible else "elastica FEM"
        runs.append(Attempt(code, f"{elements} elements", step, go))
    return runs


def rod_runs(scene: Scene, truth: float) -> list[Attempt]:
    """The rods with their default steps."""
    return [
        Attempt(
            "DER",
            f"{nodes} nodes",
            "default",
            _ours(der.simulate, truth, scene=scene, nodes=nodes, configurations=False),
        )
        for nodes in RODS
    ]


def exudyn_planar_runs(truth: float) -> list[Attempt]:
    """Exudyn's geometrically exact 2D beam on a grid of meshes, steps and shear stiffnesses."""
    # a Newton tolerance of 1e-4 makes it a third quicker than its default and costs no accuracy
    return [
        Attempt(
            "Exudyn",
            f"{elements} quadratic",
            f"{step:g} s",
            _theirs(
                peer_exudyn.simulate,
                truth,
                scene=PLANAR,
                elements=elements,
                step=step,
                shear=shear,
                newton_tolerance=1e-4,
            ),
            note=f"shear {shear:g} EA",
        )
        for shear in (10.0, 100.0)
        for elements in (12, 16, 20, 24, 32)
        for step in (2e-2, 1e-2, 5e-3)
    ]


def exudyn_ribbon_runs(truth: float) -> list[Attempt]:
    """Exudyn's geometrically exact 3D beam."""
    choices: list[tuple[int, float, bool, str]] = [
        (40, 1e-2, True, ""),
        (40, 1e-2, False, "full Newton"),
        (80, 1e-2, False, "full Newton"),
    ]
    return [
        Attempt(
            "Exudyn",
            f"{elements} linear",
            f"{step:g} s",
            _theirs(
                peer_exudyn.simulate,
                truth,
                scene=RIBBON,
                elements=elements,
                step=step,
                shear=1.0,
                newton_tolerance=1e-5,
                modified_newton=modified,
            ),
            note=note,
        )
        for elements, step, modified, note in choices
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


def cheapest(runs: Sequence[Attempt], error: float = ERROR) -> Attempt | None:
    """The cheapest of the runs whose error is at most `error`; None if there is none."""
    good = [run for run in runs if run.error is not None and abs(run.error) <= error]
    return min(good, key=lambda run: run.seconds or 0.0, default=None)


def settled(runs: Sequence[Attempt], error: float = ERROR) -> Attempt | None:
    """The cheapest run whose error, and that of all finer ones of its kind, is at most `error`.

    Errors of the mesh and of the step may have opposite signs, and cancel in some run by chance.
    Of the same kind are runs with the same note; finer ones have no fewer elements, no longer step.
    """

    def key(run: Attempt) -> tuple[str, int, float]:
        return run.note, int(run.resolution.split()[0]), -float(run.step.split()[0])

    def keeps(run: Attempt) -> bool:
        note, mesh, step = key(run)
        finer = [r for r in runs if key(r)[0] == note and key(r)[1] >= mesh and key(r)[2] >= step]
        return all(r.error is not None and abs(r.error) <= error for r in finer)

    return cheapest([run for run in runs if keeps(run)], error)


def branch_runs(program: peer_auto.Auto | None) -> list[Attempt]:
    """The static branch by elements, and by AUTO where there is a `program`."""
    truth = [fold.angle for fold in kirchhoff.equilibria(BRANCH, elements=48).folds[:FOLDS]]

    def worst(angles: Sequence[float]) -> float:
        return float(np.abs(np.array(angles[:FOLDS]) - truth).max())

    def ours(elements: int, unstable: int) -> Callable[[], tuple[float, float]]:
        def go() -> tuple[float, float]:
            begin = time.process_time()
            folds = kirchhoff.equilibria(BRANCH, elements=elements, unstable=unstable).folds
            seconds = time.process_time() - begin
            return worst([fold.angle for fold in folds]), seconds

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

    def theirs(**policy: Any) -> Callable[[], tuple[float, float]]:
        def go() -> tuple[float, float]:
            found = program.run(folds=FOLDS, **policy)
            return worst(found.folds), found.seconds

        return go

    for intervals, largest in ((25, 2.5), (25, 2.0), (50, 1.5), (25, 5.0)):
        run = Attempt(
            "AUTO-07p",
            f"{intervals} x 4",
            f"DSMAX {largest:g}",
            theirs(intervals=intervals, largest=largest),
        )
        runs.append(run)
    return runs
