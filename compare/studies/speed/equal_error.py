"""What does a snap of a ribbon cost by elements, and by the rods at their best, at an equal error?"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from compare.limits import edge_ratio, limit_of, two_point
from compare.quantities.measure import forget, function_of
from compare.report.section import Table
from ribbonfem import Scene, SolverError

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
LIMIT = {"elements": 14, "tolerance": 1e-8}

Policy = Mapping[str, Any]
Key = tuple[str, int, str, float]


@dataclass(frozen=True)
class Price:
    """The least CPU seconds, start included, with which an error is kept; `how` in words."""

    seconds: float
    how: str


def _runs() -> Iterator[tuple[Key, str, Policy]]:
    """Every run of a scene: (series, mesh, method, tolerance), model, policy."""
    for elements, tolerance in itertools.product(ELEMENTS, ELEMENTS_TOLERANCES):
        policy = {"elements": elements, "extensible": True, "tolerance": tolerance}
        yield ("elements", elements, "esdirk4", tolerance), "kirchhoff", policy
    for method, nodes, tolerance in itertools.product(METHODS, NODES, RODS_TOLERANCES):
        policy = {"nodes": nodes, "method": method, "tolerance": tolerance}
        yield ("rods", nodes, method, tolerance), "der", policy


def _snap(model: str, scene: Scene, policy: Policy) -> tuple[float, float]:
    """The angle of the snap and CPU seconds, the start's among them."""
    forget(model)
    begin = time.process_time()
    history = function_of(model, "simulate")(scene, configurations=False, until="snap", **policy)
    seconds = time.process_time() - begin
    found = history.crossing("height")
    if found is None:
        raise SolverError(f"{model}: no snap before alpha = {scene.stop!r}")
    return found[1], seconds


def measured(
    scene: Scene, rounds: int, progress: Callable[[str, Iterable[int]], Iterable[int]]
) -> tuple[dict[Key, tuple[float, float]], float]:
    """Angle and least CPU seconds of every run, by turns, and the elements' limit."""
    limit, _ = _snap("kirchhoff", scene, {**LIMIT, "extensible": True})
    found: dict[Key, tuple[float, float]] = {}
    for _, model, policy in _runs():
        # compiled, or loaded, before a clock starts
        if policy["tolerance"] == (ELEMENTS_TOLERANCES if model == "kirchhoff" else RODS_TOLERANCES)[0]:
            _snap(model, scene, policy)
    for turn in progress(f"({scene.compression:g}, {scene.shear:g})", range(rounds)):
        for key, model, policy in _runs():
            if turn and model == "der" and policy["tolerance"] < ONCE:
                continue
            angle, seconds = _snap(model, scene, policy)
            found[key] = angle, min(seconds, found[key][1]) if turn else seconds
    return found, limit


def _series(found: Mapping[Key, tuple[float, float]]) -> Iterator[tuple[str, str, str, list[Any]]]:
    """Model, method, mesh in words and (tolerance, angle, seconds), rods also of two meshes extrapolated."""
    tolerances = {"elements": ELEMENTS_TOLERANCES, "rods": RODS_TOLERANCES}
    meshes = [("elements", n, "esdirk4") for n in ELEMENTS]
    meshes += [("rods", n, method) for method in METHODS for n in NODES]
    rows = {
        (model, n, method): [(t, *found[model, n, method, t]) for t in tolerances[model]]
        for model, n, method in meshes
    }
    for model, n, method in meshes:
        unit = "elements" if model == "elements" else "nodes"
        yield model, method, f"{n} {unit}", rows[model, n, method]
    for method in METHODS:
        for coarse, fine in itertools.combinations(NODES, 2):
            ratio = edge_ratio(coarse, fine)
            pairs = zip(rows["rods", coarse, method], rows["rods", fine, method], strict=True)
            both = [(t, two_point(a, b, ratio), s + u) for (t, a, s), (_, b, u) in pairs]
            yield "rods", method, f"{coarse} and {fine} nodes", both


def prices(found: Mapping[Key, tuple[float, float]], limit: float, error: float) -> dict[str, Price]:
    """The cheapest of the elements, of the rods, and of the rods by TR-BDF2 ("rods, tr-bdf2").

    A run counts as off by the most that it or any of a tighter tolerance is off: errors of mesh and
    step may cancel by chance.
    """
    best: dict[str, Price] = {}
    for model, method, mesh, rows in _series(found):
        names = (model, "rods, tr-bdf2") if (model, method) == ("rods", "tr-bdf2") else (model,)
        worst = 0.0
        for tolerance, angle, seconds in sorted(rows):
            worst = max(worst, abs(angle - limit))
            if worst > error:
                break
            for name in names:
                if name not in best or seconds < best[name].seconds:
                    best[name] = Price(seconds, f"{mesh}, {method}, {tolerance:.0e}")
    return best


def compared(rounds: int, progress: Callable[[str, Iterable[int]], Iterable[int]]) -> list[list[Any]]:
    """A row for each scene and error: prices, their ratios, and how far the two limits are apart."""
    rows: list[list[Any]] = []
    for scene in SCENES:
        found, limit = measured(scene, rounds, progress)
        finest: Sequence[int] = NODES[-3:]
        rods, _ = limit_of([found["rods", n, "esdirk4", RODS_TOLERANCES[-1]][0] for n in finest], finest)
        for error in ERRORS:
            best = prices(found, limit, error)
            ours, rod, second = best.get("elements"), best.get("rods"), best.get("rods, tr-bdf2")
            rows.append(
                [f"({scene.compression:.2f}, {scene.shear:.2f})", error]
                + [1e3 * ours.seconds if ours else None, ours.how if ours else "none"]
                + [1e3 * rod.seconds if rod else None, rod.how if rod else "none"]
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
