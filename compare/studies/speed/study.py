"""How fast is the rod's time loop, and where does its time go?  A benchmark of steps, kernels and ramps."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

import der
from compare.report.registry import Command
from compare.report.section import Drawing, Table
from compare.studies.study import Study, here
from compare.sweep import Sweep
from der import timing
from ribbonfem import History, Scene, kirchhoff
from ribbonfem.options import whole_number
from ribbonfem.output.style import figure

from . import equal_error as equal

SNAP = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.1, damping=1.0, stop=0.6)
SLOW = Scene(compression=0.40, shear=0.40, rate=0.01, damping=10.0, stop=0.6)
RINGING = Scene(compression=0.40, shear=0.37, rate=0.01, damping=0.1, stop=0.6)
# what it is, scene, and the tolerance of its reference
RAMPS = (
    ("(0.40, 0.40) to 0.6, nu 10, rate 0.01", SLOW, 1e-6),
    ("(0.40, 0.37) to 0.6, nu 0.1, rate 0.01", RINGING, 3e-6),
)
# calls in one timing: one takes microseconds
_OFTEN = 200


def _often(call: Callable[[], Any]) -> None:
    for _ in range(_OFTEN):
        call()


def _best(call: Callable[[], Any], repeats: int = 7) -> tuple[float, float]:
    """Best and median seconds of a call."""
    taken = []
    for _ in range(repeats):
        begin = time.perf_counter()
        call()
        taken.append(time.perf_counter() - begin)
    return min(taken), statistics.median(taken)


def reference_kernel() -> float:
    """Seconds of a fixed task on this machine: a product of two dense 300 x 300 matrices."""
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(300, 300)), rng.normal(size=(300, 300))
    a @ b
    return _best(lambda: a @ b, 40)[0]


def parts_of_an_iteration(nodes: int) -> dict[str, float]:
    """Best seconds of each kernel of a Newton iteration, called from compiled-code wrappers."""
    calls = timing.parts(SNAP, nodes)
    return {name: _best(partial(_often, call), 15)[0] / _OFTEN for name, call in calls.items()}


@dataclass(frozen=True)
class Speed:
    """What was found: `scenes` are rows of the slow ramps, all times in s.

    Attributes
    ----------
    nodes, repeats: of the rod, and how often each was timed.
    steps_per_second, seconds_per_iteration: of implicit Euler, a value a repeat.
    unit: of the reference kernel.
    start: best and median of the static start.
    parts: of a Newton iteration.
    prices: rows of ribbons by elements and by rods at an equal error, if they were asked for; planar: of
        beams by the three models of elements.
    """

    nodes: int
    repeats: int
    steps_per_second: tuple[float, ...]
    seconds_per_iteration: tuple[float, ...]
    unit: float
    start: tuple[float, float]
    scenes: tuple[list[Any], ...]
    parts: dict[str, float]
    prices: tuple[list[Any], ...] = ()
    planar: tuple[list[Any], ...] = ()


def _run(scene: Scene, nodes: int | None, tolerance: float | None = None) -> History:
    """The motion of a rod, or where it has no nodes of elements that stretch, on their default mesh."""
    if nodes is None:
        return kirchhoff.simulate(scene, extensible=True, tolerance=tolerance, configurations=False)
    return der.simulate(scene, nodes=nodes, tolerance=tolerance, configurations=False)


def _seconds(scene: Scene, nodes: int | None) -> float:
    return float(_run(scene, nodes).stats["seconds"])


def _ramp(
    label: str, scene: Scene, tight: float, nodes: int | None, unit: float, taken: list[float]
) -> list[Any]:
    """A row of the slow ramps: times, errors against a tight run on the same mesh, what it took."""
    reference, history = _run(scene, nodes, tight), _run(scene, nodes)
    errors = []
    for quantity in ("slope", "height"):
        ours, truth = history.crossing(quantity), reference.crossing(quantity)
        errors.append(None if ours is None or truth is None else ours[1] - truth[1])
    stats = history.stats
    row: list[Any] = [label, min(taken), statistics.median(taken), min(taken) / unit, *errors]
    return row + [stats["steps"], stats["newton_iterations"], stats["rejected"]]


def main(
    *, nodes: int = 51, repeats: int = 5, equal_error: bool = False, sweep: Sweep | None = None
) -> Speed:
    """Measure the rod's time loop on one core: steps a second, time a Newton iteration, a profile.

    Implicit Euler at 1e-3 s with Newton stopped at an update below 1e-8 L; the static start; the
    slow scenes of the delay and skipping studies to 1e-4 in their snap angles, with the error
    of each beside its time.  Every time also as a multiple of a fixed reference kernel.
    --equal-error: what a ribbon's snap costs by elements and by the rods at their best too, on four
    scenes, and a planar one by every model of elements, on five.
    """
    whole_number("repeats", repeats, 1, 1000)
    alone = here(sweep)

    def euler(every: int) -> Any:
        options: dict[str, Any] = {"method": "implicit-euler", "step": 1e-3, "every": every}
        return der.simulate(SNAP, nodes=nodes, configurations=False, **options).stats

    # (the first runs compile)
    euler(10**6)
    der.simulate(SNAP, nodes=nodes, every=10**6, configurations=False)
    _run(SNAP, None)
    unit = reference_kernel()
    (stats,) = Study("implicit Euler", euler, [100]).by_turns(alone, repeats)
    start = _best(timing.start(SNAP, nodes), repeats)
    scenes = []
    for label, scene, tight in RAMPS:
        meshes = {"rods": nodes, "elements": None}
        timed = Study(label, partial(_seconds, scene), list(meshes.values()))
        for (name, mesh), taken in zip(meshes.items(), timed.by_turns(alone, repeats), strict=True):
            scenes.append(_ramp(f"{label}: {name}", scene, tight, mesh, unit, taken))
    return Speed(
        nodes=nodes,
        repeats=repeats,
        steps_per_second=tuple(its["steps"] / its["seconds"] for its in stats),
        seconds_per_iteration=tuple(its["seconds"] / its["newton_iterations"] for its in stats),
        unit=unit,
        start=start,
        scenes=tuple(scenes),
        parts=parts_of_an_iteration(nodes),
        prices=tuple(equal.ribbons(repeats, alone)) if equal_error else (),
        planar=tuple(equal.beams(repeats, alone)) if equal_error else (),
    )


def _stacked(parts: dict[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """Parts of an iteration with new factors, and with kept ones."""
    moved = parts["edges"] + parts["frames"]
    new = {
        "edges and frames": moved,
        "forces and Hessian": parts["forces and Hessian"],
        "factorisation": parts["copy and factorisation"] - parts["copy"],
        "solve": parts["solve"],
    }
    return new, {"edges and frames": moved, "forces": parts["forces"], "solve": parts["solve"]}


def summary(result: Speed) -> list[str]:
    """Steps a second and time an iteration, against the reference kernel."""
    return [
        f"{statistics.median(result.steps_per_second):.0f} steps of implicit Euler a second (median of "
        f"{result.repeats}; N = {result.nodes}, step 1e-3 s, Newton's update below 1e-8 L) and "
        f"{1e6 * statistics.median(result.seconds_per_iteration):.1f} us a Newton iteration. The reference "
        f"kernel, a dense 300 x 300 matrix product, takes {1e6 * result.unit:.0f} us here.",
    ]


def tables(result: Speed) -> list[Table]:
    """The loop, slow ramps, parts of an iteration."""
    rate, iteration = result.steps_per_second, result.seconds_per_iteration
    rows: list[list[Any]] = [
        ["implicit Euler, steps a second", max(rate), statistics.median(rate), None],
        ["implicit Euler, us a Newton iteration", 1e6 * min(iteration), 1e6 * statistics.median(iteration)]
        + [min(iteration) / result.unit],
        ["static start, s", *result.start, result.start[0] / result.unit],
    ]
    its = {**_stacked(result.parts)[0], "forces alone": result.parts["forces"]}
    parts = [[name, 1e6 * seconds] for name, seconds in its.items()]
    return [
        Table(
            "The loop alone",
            ["what", "best", "median", "in reference kernels"],
            rows,
            ["s", *[".4g"] * 2, ".3g"],
        ),
        Table(
            "Slow ramps with the default configurations, errors against tight ones",
            ["scene", "best (s)", "median (s)", "in reference kernels", "error of t_z = 0", "error of z = 0"]
            + ["steps", "iterations", "rejected"],
            result.scenes,
            ["s", ".3f", ".3f", ".3g", "+.1e", "+.1e", "d", "d", "d"],
            f"Rods of N = {result.nodes} by TR-BDF2, eight elements by ESDIRK4. Errors in rad, of stepping, "
            "on the same mesh; z = 0 of the second scene comes long after the first snap, out of a vibration "
            "that magnifies every difference.",
        ),
        Table(
            "Parts of a Newton iteration",
            ["part", "us"],
            parts,
            ["s", ".2f"],
            "With new factors it takes the first four, with kept ones edges and frames, forces alone and the "
            "solve: the mean above lies between the two sums.",
        ),
        *(equal.tables(result.prices, result.planar) if result.prices else ()),
    ]


def drawings(result: Speed) -> Iterator[Drawing]:
    """Where the time of an iteration goes."""
    fig, axes = figure(1, width=7.0, height=2.2)
    for row, group in enumerate(_stacked(result.parts)):
        left = 0.0
        for k, (name, seconds) in enumerate(group.items()):
            axes.barh(row, 1e6 * seconds, left=left, color=f"C{k}", edgecolor="white")
            # (in lines: the narrowest part is a tenth of the whole)
            lines = name.replace(" and ", ",\n")
            axes.text(left + 5e5 * seconds, row, lines, ha="center", va="center", fontsize=6.5)
            left += 1e6 * seconds
    axes.set_yticks([0, 1], ["new factors", "kept factors"])
    axes.set(xlabel=f"microseconds of a Newton iteration, N = {result.nodes}", ylim=(-0.6, 1.6))
    caption = "Where the time of an iteration goes, with new and with kept factors."
    yield Drawing("speed-profile.png", caption, fig)


def values(result: Speed) -> dict[str, Any]:
    """The numbers for programs."""
    return {
        "steps_per_second": list(result.steps_per_second),
        "seconds_per_iteration": list(result.seconds_per_iteration),
        "reference_kernel": result.unit,
        "start": list(result.start),
        "scenes": list(result.scenes),
        "parts": result.parts,
        "prices": list(result.prices),
        "planar": list(result.planar),
    }


COMMAND = Command(
    name="speed",
    title="The rod's time loop",
    takes="half a minute; with --equal-error three",
    main=main,
    summary=summary,
    tables=tables,
    drawings=drawings,
    values=values,
)
