"""`skipping_diagram` (Fig. 11) and `selection_diagram` (Fig. 14): outcomes sampled over rate and damping."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, cast

import numpy as np

from compare.models import MESH, MODELS, warm_up
from compare.sweep import Sweep
from ribbonfem import Drive, Ribbon, Scene, SceneError
from ribbonfem.options import OptionError, choice, flag, positive, whole_number

from .boundaries import Boundary, Line, search
from .predictions import Curves, predictions
from .result import Diagram, Failed
from .sampling import cell_points, half_interval, name_of_cell, rounds_up_to, unsure
from .setup import Sample, Setup, cost_of, mesh_of, require_runs, samples_of, setup

SAMPLES, MOST_SAMPLES = 24, 4096
# relative, of the values at boundaries
_TOLERANCE = 0.01
Cells = list[list[list[Sample]]]


def _axis(name: str, value: object) -> tuple[np.ndarray[Any, np.dtype[np.float64]], float]:
    """Centres of an axis given as (low, high, count), and their spacing in the logarithm."""
    try:
        parts = tuple(cast(Any, value))
    except TypeError:
        parts = ()
    if len(parts) != 3:
        raise OptionError(f"{name} = {value!r}: (low, high, count) is needed, as (0.01, 1.0, 20)")
    low, high = positive(f"{name}[0]", parts[0]), positive(f"{name}[1]", parts[1])
    count = whole_number(f"{name}[2]", parts[2], 2, 1000)
    if not low < high:
        raise OptionError(f"{name} = {value!r}: low must be below high")
    span = math.log(high / low)
    return low * np.exp(span * np.arange(count) / (count - 1)), span / (count - 1)


def _first_round(base: Setup, rates: Any, dampings: Any, points: Any, count: int, sweep: Sweep) -> Cells:
    work = [(base, tuple(points[j][i][:count])) for j in range(len(dampings)) for i in range(len(rates))]
    done = iter(sweep("runs", samples_of, work, cost=cost_of, prepare=lambda: warm_up(base.model)))
    return [[list(next(done)) for _ in rates] for _ in dampings]


def _fill(base: Setup, cells: Cells, points: Any, sizes: Sequence[int], sweep: Sweep) -> None:
    """The later rounds: more runs where they disagree."""
    for number, size in enumerate(sizes[1:]):
        chosen = unsure(cells, first=number == 0)
        if not chosen:
            return
        before = sizes[number]
        work = [(base, tuple(points[j][i][before:size])) for j, i in chosen]
        for (j, i), more in zip(
            chosen, sweep(f"runs, up to {size} a cell", samples_of, work, cost=cost_of), strict=True
        ):
            cells[j][i] += more


def _boundaries(base: Setup, rates: Any, dampings: Any, names: Any, sweep: Sweep) -> tuple[Boundary, ...]:
    """Changes between sure cells of a row, and of a column, that lie next to each other or have only cut or
    mixed ones between them."""
    lines: list[Line] = []
    what: list[tuple[str, float]] = []
    for along, axis, other, table in (
        ("rate", rates, dampings, names),
        ("damping", dampings, rates, np.transpose(names)),
    ):
        for row, fixed in zip(table, other, strict=True):
            sure = [k for k, name in enumerate(row) if name not in ("", "cut", "mixed")]
            for a, b in pairwise(sure):
                if row[a] != row[b]:
                    lines.append(Line((float(axis[a]), float(axis[b])), _TOLERANCE, {}))
                    what.append((along, float(fixed)))

    def run(work: list[tuple[int, float]]) -> list[str]:
        tasks = []
        for k, value in work:
            along, fixed = what[k]
            tasks.append((base, ((value, fixed),) if along == "rate" else ((fixed, value),)))
        return [result[0].outcome for result in sweep("boundaries", samples_of, tasks, cost=cost_of)]

    search(lines, run)
    mesh = mesh_of(base.model, base.options)[MESH[base.model]]
    return tuple(
        Boundary(along, fixed, *change, mesh)
        for line, (along, fixed) in zip(lines, what, strict=True)
        for change in line.changes()
    )


def _diagram(
    scene: Scene,
    rates: object,
    dampings: object,
    model: str,
    samples: int,
    boundaries: bool,
    seed: int,
    sweep: Sweep | None,
    options: Mapping[str, Any],
) -> Diagram:
    choice("model", model, ("der", "kirchhoff"))
    require_runs(model, options)
    whole_number("samples", samples, 1, MOST_SAMPLES)
    whole_number("seed", seed, 0)
    flag("boundaries", boundaries)
    x, step = _axis("rates", rates)
    y, rise = _axis("dampings", dampings)
    sweep = sweep or Sweep()
    base = setup(scene, model, options)
    points = [
        [cell_points((float(r), float(d)), (step, rise), samples, (seed, i, j)) for i, r in enumerate(x)]
        for j, d in enumerate(y)
    ]
    sizes = rounds_up_to(samples)
    cells = _first_round(base, x, y, points, sizes[0], sweep)
    _fill(base, cells, points, sizes, sweep)
    every = tuple(sample for row in cells for cell in row for sample in cell)
    # (a run may come to rest where no state was found)
    names = tuple(dict.fromkeys((*base.names, *(sample.outcome for sample in every if sample.outcome))))
    shares = np.full((len(y), len(x), len(names)), np.nan)
    uncertainty, runs = np.full(shares.shape[:2], np.nan), np.zeros(shares.shape[:2], dtype=np.int64)
    outcome = np.empty(shares.shape[:2], dtype="<U10")
    for j, row in enumerate(cells):
        for i, cell in enumerate(row):
            counts = [sum(sample.outcome == name for sample in cell) for name in names]
            runs[j, i] = total = sum(counts)
            if total:
                shares[j, i] = np.array(counts) / total
            uncertainty[j, i] = half_interval(max(counts), total)
            outcome[j, i] = name_of_cell(cell, len(cell) >= samples)
    curves = predictions(base, x, y) if scene.stop is None else Curves()
    return Diagram(
        kind="skipping" if scene.stop is None else "selection",
        rates=x,
        dampings=y,
        outcomes=names,
        shares=shares,
        uncertainty=uncertainty,
        runs=runs,
        outcome=outcome,
        failed=tuple(Failed(s.rate, s.damping, s.reason) for s in every if not s.outcome),
        boundaries=_boundaries(base, x, y, outcome, sweep) if boundaries else (),
        samples=every,
        folds=tuple(fold.control for fold in base.folds),
        predicted=curves,
        unpredicted=getattr(curves, "missing", {}),
        scene=scene,
        model=model,
        options=dict(options),
        seed=seed,
    )


def skipping_diagram(
    compression: float,
    shear: float,
    rates: tuple[float, float, int] = (0.01, 1.0, 20),
    dampings: tuple[float, float, int] = (0.1, 30.0, 20),
    *,
    start: str = "U+S+",
    drive: str | Drive | Mapping[str, float] = "left",
    preset: Mapping[str, float] | None = None,
    gravity: tuple[float, float, float] | None = None,
    model: str = "der",
    ribbon: Ribbon | None = None,
    samples: int = SAMPLES,
    boundaries: bool = True,
    seed: int = 0,
    sweep: Sweep | None = None,
    **options: Any,
) -> Diagram:
    """Which shape a ramp from a US state skips, over rate and damping (paper, Fig. 11).

    Parameters
    ----------
    compression, shear: dL/L and dW/L, where both U+S+ and U+S- are stable.
    rates, dampings: (low, high, count) of the control (rad/s, L/s, ...) and in 1/s: centres at
        low (high/low)^(k/(count - 1)); a cell reaches half a spacing to every side of its centre, in the
        logarithms.
    start, drive, preset, gravity: as of a `Scene`.  Rates are positive: which way the control goes is said
        by the drive, as `Drive(left=-1)`.
    model: "der" or "kirchhoff".
    ribbon: the default `Ribbon` if None.
    samples: runs of a cell at the most; 1 is its centre alone.
    boundaries: whether changes between sure cells are solved for, to 1 % on the mesh of the runs.
    seed: of the scrambled points.
    sweep: runs the tasks; by default on one worker process a processor, and keeps nothing.
    options: of the model's `simulate`: nodes or elements, tolerance, method, ...

    Returns
    -------
    `Diagram`, of "no skip", "type 1", "type 2", "first only" (the second snap never came) and "none".

    Raises
    ------
    SceneError, OptionError
        For a ribbon without both states, a rig whose slow ramp does not meet two folds with a state between
        them (it says what the ramp meets), a grid or options that cannot be.
    SolverError, SweepError
        If its states are not found; if workers are lost again and again.
    """
    scene = Scene(
        compression=compression,
        shear=shear,
        start=start,
        drive=drive,
        preset=preset,
        gravity=gravity,
        ribbon=ribbon or Ribbon(),
    )
    return _diagram(scene, rates, dampings, model, samples, boundaries, seed, sweep, options)


def selection_diagram(
    compression: float,
    shear: float,
    stop: float,
    rates: tuple[float, float, int] = (0.01, 1.0, 20),
    dampings: tuple[float, float, int] = (0.1, 30.0, 20),
    *,
    start: str = "U+S+",
    drive: str | Drive | Mapping[str, float] = "left",
    preset: Mapping[str, float] | None = None,
    gravity: tuple[float, float, float] | None = None,
    model: str = "der",
    ribbon: Ribbon | None = None,
    samples: int = SAMPLES,
    boundaries: bool = True,
    seed: int = 0,
    sweep: Sweep | None = None,
    **options: Any,
) -> Diagram:
    """In which shape a ramp to `stop`, then held, comes to rest, over rate and damping (paper, Fig. 14).

    `stop` is of the control, and positive; the start may be any stable state.  Other parameters, and errors,
    as in `skipping_diagram`.  The outcomes are names of shapes: of a plain ramp from a US state all four,
    else those of the stable states that are found at the stop, by the signs of the height over the mean of
    the clamps' and of the slope; a second one of the same signs has a number.  A scene whose state at rest is
    lost at a pitchfork before the stop is refused: a preset is needed.
    """
    if stop is None:
        raise SceneError("Scene.stop = None: selection needs the angle (rad) at which the clamp stops")
    scene = Scene(
        compression=compression,
        shear=shear,
        start=start,
        drive=drive,
        rate=1.0,
        stop=stop,
        preset=preset,
        gravity=gravity,
        ribbon=ribbon or Ribbon(),
    )
    return _diagram(scene, rates, dampings, model, samples, boundaries, seed, sweep, options)


def both(diagrams: Mapping[str, Diagram]) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """(m, n) where the shares of two models are further apart than their intervals allow."""
    one, two = diagrams.values()
    apart = np.nanmax(np.abs(np.array(one.shares) - np.array(two.shares)), axis=2)
    return np.asarray(apart > np.array(one.uncertainty) + np.array(two.uncertainty))


__all__ = ["MODELS", "SAMPLES", "both", "selection_diagram", "skipping_diagram"]
