"""What a ribbon's snap costs by elements and by rods, each at its best, at an equal error."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from compare.limits import edge_ratio, limit_of, two_point
from compare.quantities.measure import forget, function_of
from compare.report.section import Table
from compare.sweep import Sweep
from ribbonfem import Scene, SolverError

from .study import Study, cheapest, settled

# scenes, errors (rad), meshes, methods of the rods
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


def table(rows: Sequence[list[Any]]) -> Table:
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
