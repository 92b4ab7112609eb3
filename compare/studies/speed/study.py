"""How fast is the rod's time loop, and where does its time go?"""

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
from compare.sweep import Progress, Sweep
from der import profile
from ribbonfem import History, Scene, kirchhoff
from ribbonfem.options import whole_number
from ribbonfem.output.style import figure

from . import equal_error as equal

SNAP = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.1, damping=1.0, stop=0.6)
SLOW = Scene(compression=0.40, shear=0.40, rate=0.01, damping=10.0, stop=0.6)
RINGING = Scene(compression=0.40, shear=0.37, rate=0.01, damping=0.1, stop=0.6)


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
    calls = profile.parts(SNAP, nodes)
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
    prices: rows of ribbons by elements and by rods at an equal error, if they were asked for.
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


def _run(scene: Scene, nodes: int | None, tolerance: float | None = None) -> History:
    """The motion of a rod, or where it has no nodes of elements that stretch, on their default mesh."""
    if nodes is None:
        return kirchhoff.simulate(scene, extensible=True, tolerance=tolerance, configurations=False)
    return der.simulate(scene, nodes=nodes, tolerance=tolerance, configurations=False)


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
    scenes.
    """
    whole_number("repeats", repeats, 1, 1000)
    progress = sweep.progress if sweep else Progress()
    for method, step in (("implicit-euler", 1e-3), ("tr-bdf2", None)):
        der.simulate(SNAP, nodes=nodes, method=method, step=step, every=10**6, configurations=False)
    unit = reference_kernel()
    euler = [
        der.simulate(
            SNAP, nodes=nodes, method="implicit-euler", step=1e-3, every=100, configurations=False
        ).stats
        for _ in progress("implicit Euler", range(repeats))
    ]
    start = _best(profile.start(SNAP, nodes), repeats)
    scenes = []
    for label, scene, tight in (
        ("(0.40, 0.40) to 0.6, nu 10, rate 0.01", SLOW, 1e-6),
        ("(0.40, 0.37) to 0.6, nu 0.1, rate 0.01", RINGING, 3e-6),
    ):
        # (the first run compiles) then by turns, so that a busy machine is busy for both
        meshes = {"rods": nodes, "elements": None}
        _run(SNAP, None)
        taken: dict[str, list[float]] = {name: [] for name in meshes}
        for _ in progress(label, range(repeats)):
            for name, mesh in meshes.items():
                taken[name].append(float(_run(scene, mesh).stats["seconds"]))
        for name, mesh in meshes.items():
            scenes.append(_ramp(f"{label}: {name}", scene, tight, mesh, unit, taken[name]))
    return Speed(
        nodes=nodes,
        repeats=repeats,
        steps_per_second=tuple(stats["steps"] / stats["seconds"] for stats in euler),
        seconds_per_iteration=tuple(stats["seconds"] / stats["newton_iterations"] for stats in euler),
        unit=unit,
        start=start,
        scenes=tuple(scenes),
        parts=parts_of_an_iteration(nodes),
        prices=tuple(equal.compared(repeats, progress)) if equal_error else (),
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


def words(found: Speed) -> list[str]:
    """Steps a second and time an iteration, against the reference kernel."""
    return [
        f"{statistics.median(found.steps_per_second):.0f} steps of implicit Euler a second (median of "
        f"{found.repeats}; N = {found.nodes}, step 1e-3 s, Newton's update below 1e-8 L) and "
        f"{1e6 * statistics.median(found.seconds_per_iteration):.1f} us a Newton iteration. The reference "
        f"kernel, a dense 300 x 300 matrix product, takes {1e6 * found.unit:.0f} us here.",
    ]


def tables(found: Speed) -> list[Table]:
    """The loop, slow ramps, parts of an iteration."""
    rate, iteration, unit = found.steps_per_second, found.seconds_per_iteration, found.unit
    rows: list[list[Any]] = [
        ["implicit Euler, steps a second", max(rate), statistics.median(rate), None],
        ["implicit Euler, us a Newton iteration", 1e6 * min(iteration), 1e6 * statistics.median(iteration)]
        + [min(iteration) / unit],
        ["static start, s", *found.start, found.start[0] / unit],
    ]
    parts = (*_stacked(found.parts)[0].items(), ("forces alone", found.parts["forces"]))
    priced = [equal.table(found.prices)] if found.prices else []
    return [
        Table(
            "The loop alone",
            ["what", "best", "median", "in reference kernels"],
            rows,
            ["s", ".4g", ".4g", ".3g"],
        ),
        Table(
            "Slow ramps with the default policies, errors against tight ones",
            ["scene", "best (s)", "median (s)", "in reference kernels", "error of t_z = 0", "error of z = 0"]
            + ["steps", "iterations", "rejected"],
            found.scenes,
            ["s", ".3f", ".3f", ".3g", "+.1e", "+.1e", "d", "d", "d"],
            f"Rods of N = {found.nodes} by TR-BDF2, eight elements by ESDIRK4. Errors in rad, of stepping, "
            "on the same mesh; z = 0 of the second scene comes long after the first snap, out of a vibration "
            "that magnifies every difference.",
        ),
        Table(
            "Parts of a Newton iteration",
            ["part", "us"],
            [[name, 1e6 * seconds] for name, seconds in parts],
            ["s", ".2f"],
        ),
        *priced,
    ]


def drawings(found: Speed) -> Iterator[Drawing]:
    """Where the time of an iteration goes."""
    fig, axes = figure(1, width=7.0, height=2.2)
    for row, group in enumerate(_stacked(found.parts)):
        left = 0.0
        for k, (name, seconds) in enumerate(group.items()):
            axes.barh(row, 1e6 * seconds, left=left, color=f"C{k}", edgecolor="white")
            # (in lines: the narrowest part is a tenth of the whole)
            lines = name.replace(" and ", ",\n")
            axes.text(left + 5e5 * seconds, row, lines, ha="center", va="center", fontsize=6.5)
            left += 1e6 * seconds
    axes.set_yticks([0, 1], ["new factors", "kept factors"])
    axes.set(xlabel=f"microseconds of a Newton iteration, N = {found.nodes}", ylim=(-0.6, 1.6))
    caption = "Where the time of an iteration goes, with new and with kept factors."
    yield Drawing("speed-profile.png", caption, fig)


def values(found: Speed) -> dict[str, Any]:
    """The numbers for programs."""
    return {
        "steps_per_second": list(found.steps_per_second),
        "seconds_per_iteration": list(found.seconds_per_iteration),
        "reference_kernel": found.unit,
        "start": list(found.start),
        "scenes": list(found.scenes),
        "parts": found.parts,
        "prices": list(found.prices),
    }


COMMAND = Command(
    name="speed",
    title="The rod's time loop",
    takes="half a minute; with --equal-error two",
    main=main,
    words=words,
    tables=tables,
    drawings=drawings,
    values=values,
)
