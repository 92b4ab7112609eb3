"""How fast is the rod's time loop, and where does its time go?  A benchmark of steps, kernels and ramps."""

from __future__ import annotations

import itertools
import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

import der
from compare.limits import edge_ratio, limit_of, two_point
from compare.quantities.measure import forget, function_of
from compare.report.registry import Command
from compare.report.section import Drawing, Table
from compare.sweep import Sweep
from der import timing
from ribbonfem import History, Scene, SolverError, kirchhoff
from ribbonfem.options import whole_number
from ribbonfem.output.style import figure

from .study import Study, cheapest, here, settled

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

# at an equal error: scenes, errors (rad), meshes, methods of the rods
SCENES = tuple(
    Scene(compression=compression, shear=shear, start="U+S-", rate=0.1, damping=1.0, stop=0.65)
    for compression, shear in ((0.40, 0.37), (0.38, 0.37), (0.33, 0.34), (0.45, 0.40))
)
ERRORS = (1e-4, 1e-5, 1e-6)
ELEMENTS, NODES = (4, 6, 8, 10), (25, 35, 51, 71, 101, 141, 201)
METHODS = ("esdirk4", "tr-bdf2")
# the last of them is the rods' limit's
RODS_TOLERANCES = tuple(3e-3 * 10.0 ** (-i / 3) for i in range(12))
ELEMENTS_TOLERANCES = tuple(1e-3 * 10.0 ** (-i / 4) for i in range(15))
# runs of rods below this tolerance take a second and are timed once
ONCE = 1e-5
LIMIT = {"elements": 14, "extensible": True, "tolerance": 1e-8}

Options = Mapping[str, Any]
Key = tuple[str, int, str, float]


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


class Price(NamedTuple):
    """A run of a ribbon's snap: CPU seconds, start included, with which its angle is had; `how` in words."""

    series: tuple[str, str, str]
    tolerance: float
    angle: float
    seconds: float

    @property
    def how(self) -> str:
        """Mesh, method and tolerance."""
        _, method, mesh = self.series
        return f"{mesh}, {method}, {self.tolerance:.0e}"


def _runs() -> Iterator[tuple[Key, str, Options]]:
    """Every run of a scene: (series, mesh, method, tolerance), model, configuration."""
    for elements, tolerance in itertools.product(ELEMENTS, ELEMENTS_TOLERANCES):
        options = {"elements": elements, "extensible": True, "tolerance": tolerance}
        yield ("elements", elements, "esdirk4", tolerance), "kirchhoff", options
    for method, nodes, tolerance in itertools.product(METHODS, NODES, RODS_TOLERANCES):
        options = {"nodes": nodes, "method": method, "tolerance": tolerance}
        yield ("rods", nodes, method, tolerance), "der", options


def _snap(model: str, scene: Scene, options: Options) -> tuple[float, float]:
    """The angle of the snap and CPU seconds, the start's among them."""
    forget(model)
    begin = time.process_time()
    history = function_of(model, "simulate")(scene, configurations=False, until="snap", **options)
    seconds = time.process_time() - begin
    result = history.crossing("height")
    if result is None:
        raise SolverError(f"{model}: no snap before alpha = {scene.stop!r}")
    return result[1], seconds


def measured(scene: Scene, rounds: int, sweep: Sweep) -> tuple[dict[Key, tuple[float, float]], float]:
    """Angle and least CPU seconds of every run, by turns, and the elements' limit."""
    runs = list(_runs())
    quick = [run for run in runs if run[1] != "der" or run[2]["tolerance"] >= ONCE]
    for _, model, options in runs:
        # compiled, or loaded, before a clock starts
        if options["tolerance"] == (ELEMENTS_TOLERANCES if model == "kirchhoff" else RODS_TOLERANCES)[0]:
            _snap(model, scene, options)
    title = f"({scene.compression:g}, {scene.shear:g})"

    def snap(run: tuple[Key, str, Options]) -> tuple[float, float]:
        return _snap(run[1], scene, run[2])

    result = {run[0]: [first] for run, first in Study(title, snap, runs).rows(sweep)}
    for run, more in zip(quick, Study(title, snap, quick).by_turns(sweep, rounds - 1), strict=True):
        result[run[0]] += more
    least = {key: (its[-1][0], min(seconds for _, seconds in its)) for key, its in result.items()}
    return least, _snap("kirchhoff", scene, LIMIT)[0]


def _series(result: Mapping[Key, tuple[float, float]]) -> Iterator[Price]:
    """Every run, and rods of two meshes extrapolated."""
    for (model, mesh, method, tolerance), took in result.items():
        unit = "elements" if model == "elements" else "nodes"
        yield Price((model, method, f"{mesh} {unit}"), tolerance, *took)
    pairs = itertools.combinations(NODES, 2)
    for method, (coarse, fine), tolerance in itertools.product(METHODS, pairs, RODS_TOLERANCES):
        (a, s), (b, u) = (result["rods", n, method, tolerance] for n in (coarse, fine))
        angle = two_point(a, b, edge_ratio(coarse, fine))
        yield Price(("rods", method, f"{coarse} and {fine} nodes"), tolerance, angle, s + u)


def prices(result: Mapping[Key, tuple[float, float]], limit: float, error: float) -> dict[str, Price]:
    """The cheapest of the elements, of the rods, and of the rods by TR-BDF2 ("rods, tr-bdf2")."""
    runs = list(
        settled(
            _series(result),
            error=lambda run: abs(run.angle - limit),
            kind=lambda run: run.series,
            size=lambda run: (run.tolerance,),
        )
    )
    best = {
        name: cheapest([one for one in runs if one[0].series[: len(of)] == of], lambda r: r.seconds, error)
        for name, of in (
            ("elements", ("elements",)),
            ("rods", ("rods",)),
            ("rods, tr-bdf2", ("rods", "tr-bdf2")),
        )
    }
    return {name: run for name, run in best.items() if run is not None}


def compared(rounds: int, sweep: Sweep) -> list[list[Any]]:
    """A row for each scene and error: prices, their ratios, and how far the two limits are apart."""
    rows: list[list[Any]] = []
    for scene in SCENES:
        result, limit = measured(scene, rounds, sweep)
        finest = [result["rods", n, "esdirk4", RODS_TOLERANCES[-1]][0] for n in NODES[-3:]]
        rods, _ = limit_of(finest, NODES[-3:])
        for error in ERRORS:
            best = prices(result, limit, error)
            ours, rod, second = (best.get(name) for name in ("elements", "rods", "rods, tr-bdf2"))
            rows.append(
                [f"({scene.compression:.2f}, {scene.shear:.2f})", error]
                + ([1e3 * ours.seconds, ours.how] if ours else [None, "none"])
                + ([1e3 * rod.seconds, rod.how] if rod else [None, "none"])
                + [ours.seconds / other.seconds if ours and other else None for other in (rod, second)]
                + [abs(rods - limit)]
            )
    return rows


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
    scenes.
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
        prices=tuple(compared(repeats, alone)) if equal_error else (),
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


def _priced(rows: Sequence[list[Any]]) -> Table:
    """The rows of `compared`."""
    return Table(
        "CPU time of a ribbon's snap at an equal error, by turns",
        ["scene", "error (rad)", "elements (ms)", "by", "rods (ms)", "by", "elements / rods"]
        + ["elements / rods by TR-BDF2", "limits apart"],
        rows,
        ["s", ".0e", ".1f", "s", ".1f", "s", ".2f", ".2f", ".0e"],
        "From U+S-, 0.1 rad/s, nu 1, the start included, least of all rounds. Both stretch. The cheapest of "
        "every mesh, method and tolerance, and of rods of two meshes extrapolated, whose error, and that of "
        "every tighter tolerance, is below the given one. Errors are from the elements' limit; the last "
        "column is how far the rods' own is from it.",
    )


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
        Table("Parts of a Newton iteration", ["part", "us"], parts, ["s", ".2f"]),
        *([_priced(result.prices)] if result.prices else []),
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
    }


COMMAND = Command(
    name="speed",
    title="The rod's time loop",
    takes="half a minute; with --equal-error two",
    main=main,
    summary=summary,
    tables=tables,
    drawings=drawings,
    values=values,
)
