"""What a snap costs by each model at its best, at an equal error: ribbons, and beams in the plane."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from compare.limits import edge_ratio, limit_of, two_point
from compare.quantities.measure import forget, function_of
from compare.report.section import Table
from compare.studies.study import Study, cheapest, settled
from compare.sweep import Sweep
from ribbonfem import Scene, SolverError

Options = Mapping[str, Any]
# of whom, mesh, method, tolerance (L)
Key = tuple[str, str, str, float]

# scenes, and errors (rad)
RIBBONS = tuple(
    Scene(compression=compression, shear=shear, start="U+S-", rate=0.1, damping=1.0, stop=0.65)
    for compression, shear in ((0.40, 0.37), (0.38, 0.37), (0.33, 0.34), (0.45, 0.40))
)
BEAMS = tuple(
    Scene(compression=compression, shear=0.0, start="U+", rate=rate, damping=damping, stop=stop)
    for compression, rate, damping, stop in (
        (0.40, 0.1, 1.0, 2.0),
        (0.10, 0.03, 1.0, 2.0),
        (0.20, 0.3, 0.5, 3.0),
        (0.30, 1.0, 1.0, 4.0),
        (0.45, 2.0, 2.0, 6.0),
    )
)
ERRORS = (1e-4, 1e-5, 1e-6)
METHODS = ("esdirk4", "tr-bdf2")
NODES = (25, 35, 51, 71, 101, 141, 201)
# runs below this tolerance, of rods, take a second and are timed once
ONCE = 1e-5


@dataclass(frozen=True)
class Runs:
    """Runs that compete.

    Attributes
    ----------
    name: of whom; model: whose `simulate`.
    meshes: by their names.
    methods, tolerances: with which each is run, the coarsest tolerance first.
    limit: options of the run from which their errors count; None for that of the first of all.
    """

    name: str
    model: str
    meshes: Mapping[str, Options]
    methods: tuple[str, ...]
    tolerances: tuple[float, ...]
    limit: Options | None = None

    def __iter__(self) -> Iterator[tuple[Key, str, Options]]:
        for mesh, method, tolerance in itertools.product(self.meshes, self.methods, self.tolerances):
            options = {**self.meshes[mesh], "method": method, "tolerance": tolerance}
            yield (self.name, mesh, method, tolerance), self.model, options


def _of_elements(*counts: int) -> dict[str, Options]:
    return {f"{count} elements": {"elements": count, "extensible": True} for count in counts}


def _down(first: float, ratio: float, count: int) -> tuple[float, ...]:
    return tuple(first * ratio**-i for i in range(count))


_LIMIT = {"extensible": True, "tolerance": 1e-8}
ELEMENTS = Runs(
    "elements",
    "kirchhoff",
    _of_elements(4, 6, 8, 10),
    METHODS[:1],
    _down(1e-3, 10.0**0.25, 15),
    {"elements": 14, **_LIMIT},
)
# (the last of the tolerances is the rods' limit's)
RODS = Runs(
    "rods", "der", {f"{n} nodes": {"nodes": n} for n in NODES}, METHODS, _down(3e-3, 10.0 ** (1 / 3), 12)
)
_BEAM_TOLERANCES = _down(2.8e-3, 2.0**0.5, 27)
PLANAR = (
    replace(ELEMENTS, tolerances=_BEAM_TOLERANCES, limit={"elements": 16, **_LIMIT}),
    Runs("elastica", "elastica", _of_elements(4, 5, 6, 8, 10), METHODS[:1], _BEAM_TOLERANCES),
    Runs(
        "quasi-linear",
        "quasilinear",
        {f"degree {degree}": {"degree": degree} for degree in (10, 11, 13, 15, 19)},
        METHODS[:1],
        _BEAM_TOLERANCES,
        {"degree": 26, "tolerance": 1e-9},
    ),
)


class Price(NamedTuple):
    """A run of a snap: CPU seconds, start included, with which its angle is had; `how` in words."""

    series: tuple[str, str, str]
    tolerance: float
    off: float
    seconds: float

    @property
    def how(self) -> str:
        """Mesh, method and tolerance."""
        _, method, mesh = self.series
        return f"{mesh}, {method}, {self.tolerance:.0e}"


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


Timed = Mapping[Key, tuple[float, float]]


def timed(scene: Scene, rivals: Sequence[Runs], rounds: int, sweep: Sweep) -> tuple[Timed, dict[str, float]]:
    """Angle and least CPU seconds of every run, by turns, and the limits of those that have one."""
    runs = [run for rival in rivals for run in rival]
    quick = [run for run in runs if run[1] != "der" or run[2]["tolerance"] >= ONCE]
    for rival in rivals:
        # compiled, or loaded, before a clock starts
        for _, model, options in rival:
            if options["tolerance"] == rival.tolerances[0]:
                _snap(model, scene, options)
    title = f"({scene.compression:g}, {scene.shear:g})"

    def snap(run: tuple[Key, str, Options]) -> tuple[float, float]:
        return _snap(run[1], scene, run[2])

    result = {run[0]: [first] for run, first in Study(title, snap, runs).rows(sweep)}
    for run, more in zip(quick, Study(title, snap, quick).by_turns(sweep, rounds - 1), strict=True):
        result[run[0]] += more
    least = {key: (its[-1][0], min(seconds for _, seconds in its)) for key, its in result.items()}
    limits = {one.name: _snap(one.model, scene, one.limit)[0] for one in rivals if one.limit is not None}
    return least, limits


def _series(result: Timed, limits: Mapping[str, float]) -> Iterator[Price]:
    """Every run, and rods of two meshes extrapolated."""
    usual = next(iter(limits.values()))
    for (name, mesh, method, tolerance), (angle, seconds) in result.items():
        yield Price((name, method, mesh), tolerance, abs(angle - limits.get(name, usual)), seconds)
    if not any(name == RODS.name for name, *_ in result):
        return
    pairs = itertools.combinations(NODES, 2)
    for method, (coarse, fine), tolerance in itertools.product(METHODS, pairs, RODS.tolerances):
        (a, s), (b, u) = (result[RODS.name, f"{n} nodes", method, tolerance] for n in (coarse, fine))
        off = abs(two_point(a, b, edge_ratio(coarse, fine)) - usual)
        yield Price((RODS.name, method, f"{coarse} and {fine} nodes"), tolerance, off, s + u)


def prices(result: Timed, limits: Mapping[str, float], error: float) -> dict[str, Price]:
    """The cheapest of each, by name, of the rods by TR-BDF2 too ("rods, tr-bdf2")."""
    runs = list(
        settled(
            _series(result, limits),
            error=lambda run: run.off,
            kind=lambda run: run.series,
            size=lambda run: (run.tolerance,),
        )
    )
    of: dict[str, tuple[str, ...]] = {name: (name,) for name in dict.fromkeys(key[0] for key in result)}
    of["rods, tr-bdf2"] = ("rods", "tr-bdf2")
    best = {
        name: cheapest([one for one in runs if one[0].series[: len(its)] == its], lambda r: r.seconds, error)
        for name, its in of.items()
    }
    return {name: run for name, run in best.items() if run is not None}


def _told(best: Mapping[str, Price], name: str) -> list[Any]:
    """Milliseconds and how, of the cheapest."""
    return [1e3 * best[name].seconds, best[name].how] if name in best else [None, "none"]


def _over(best: Mapping[str, Price], one: str, other: str) -> float | None:
    return best[one].seconds / best[other].seconds if one in best and other in best else None


def ribbons(rounds: int, sweep: Sweep) -> list[list[Any]]:
    """A row for each scene and error: prices, their ratios, and how far the two limits are apart."""
    rows: list[list[Any]] = []
    for scene in RIBBONS:
        result, limits = timed(scene, (ELEMENTS, RODS), rounds, sweep)
        finest = [result[RODS.name, f"{n} nodes", METHODS[0], RODS.tolerances[-1]][0] for n in NODES[-3:]]
        rods, _ = limit_of(finest, NODES[-3:])
        for error in ERRORS:
            best = prices(result, limits, error)
            rows.append(
                [f"({scene.compression:.2f}, {scene.shear:.2f})", error]
                + [*_told(best, "elements"), *_told(best, "rods"), _over(best, "elements", "rods")]
                + [_over(best, "elements", "rods, tr-bdf2"), abs(rods - limits["elements"])]
            )
    return rows


def beams(rounds: int, sweep: Sweep) -> list[list[Any]]:
    """A row for each planar scene and error: prices, and their ratios to the elements of three dimensions."""
    rows: list[list[Any]] = []
    for scene in BEAMS:
        result, limits = timed(scene, PLANAR, rounds, sweep)
        for error in ERRORS:
            best = prices(result, limits, error)
            rows.append(
                [f"{scene.compression:.2f}, {scene.rate:g} rad/s, nu {scene.damping:g}", error]
                + [part for one in PLANAR for part in _told(best, one.name)]
                + [_over(best, one.name, "elements") for one in PLANAR[1:]]
            )
    return rows


def tables(of_ribbons: Sequence[list[Any]], of_beams: Sequence[list[Any]]) -> Iterator[Table]:
    """The rows of `ribbons` and of `beams`."""
    yield Table(
        "CPU time of a ribbon's snap at an equal error, by turns",
        ["scene", "error (rad)", "elements (ms)", "by", "rods (ms)", "by", "elements / rods"]
        + ["elements / rods by TR-BDF2", "limits apart"],
        of_ribbons,
        ["s", ".0e", ".1f", "s", ".1f", "s", ".2f", ".2f", ".0e"],
        "From U+S-, 0.1 rad/s, nu 1, the start included, least of all rounds. Both stretch. The cheapest of "
        "every mesh, method and tolerance, and of rods of two meshes extrapolated, whose error, and that of "
        "every tighter tolerance, is below the given one. Errors are from the elements' limit; the last "
        "column is how far the rods' own is from it.",
    )
    yield Table(
        "CPU time of a planar snap at an equal error, by turns",
        ["dL, rate, nu", "error (rad)"]
        + [part for one in PLANAR for part in (f"{one.name} (ms)", "by")]
        + [f"{one.name} / elements" for one in PLANAR[1:]],
        of_beams,
        ["s", ".0e", *[".2f", "s"] * len(PLANAR), *[".2f"] * (len(PLANAR) - 1)],
        "As for ribbons. Elements and elastica stretch, and their errors are from the elements' limit; the "
        "beam of small slopes has its own.",
    )
