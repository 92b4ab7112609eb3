"""`outcome_diagram`: outcomes sampled over two numbers of a scene; the paper's over rate and damping."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from compare.models import MESH, MODELS, warm_up
from compare.sweep import Sweep
from ribbonfem import Drive, Ribbon, Scene, SceneError
from ribbonfem.options import a_scene, choice, flag, whole_number

from .axes import Axis, axes_of, axis_of
from .boundaries import Boundary, Line, search
from .predictions import Curves, predictions
from .result import Diagram, Failed
from .sampling import cell_points, half_interval, name_of_cell, rounds_up_to, unsure
from .setup import (
    RATE_AND_DAMPING,
    Sample,
    Setup,
    cost_of,
    mesh_of,
    require_runs,
    samples_of,
    setup,
)

SAMPLES, MOST_SAMPLES = 24, 4096
# of the values at boundaries, relative or in as large a part of some four cells
_TOLERANCE = 0.01
Cells = list[list[list[Sample]]]


def _first_round(base: Setup, points: Any, count: int, sweep: Sweep) -> Cells:
    work = [(base, tuple(cell[:count])) for row in points for cell in row]
    done = iter(sweep("runs", samples_of, work, cost=cost_of, prepare=lambda: warm_up(base.model)))
    return [[list(next(done)) for _ in row] for row in points]


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


def _boundaries(base: Setup, axes: tuple[Axis, Axis], names: Any, sweep: Sweep) -> tuple[Boundary, ...]:
    """Changes between sure cells of a row, and of a column, that lie next to each other or have only cut or
    mixed ones between them."""
    lines: list[Line] = []
    what: list[tuple[str, float]] = []
    for axis, other, table in (axes[0], axes[1], names), (axes[1], axes[0], np.transpose(names)):
        for row, fixed in zip(table, other.values, strict=True):
            sure = [k for k, name in enumerate(row) if name not in ("", "cut", "mixed")]
            for a, b in pairwise(sure):
                if row[a] != row[b]:
                    ends = float(axis.values[a]), float(axis.values[b])
                    lines.append(Line(ends, _TOLERANCE, {}, axis=axis))
                    what.append((axis.name, float(fixed)))

    def run(work: list[tuple[int, float]]) -> list[str]:
        tasks = []
        for k, value in work:
            along, fixed = what[k]
            tasks.append((base, ((value, fixed),) if along == base.over[0] else ((fixed, value),)))
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
    axes: tuple[Axis, Axis],
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
    across, up = axes
    sweep = sweep or Sweep()
    base = setup(scene, model, options, (across.name, up.name))
    points = [
        [cell_points(axes, (i, j), samples, (seed, i, j)) for i in range(len(across.values))]
        for j in range(len(up.values))
    ]
    sizes = rounds_up_to(samples)
    cells = _first_round(base, points, sizes[0], sweep)
    _fill(base, cells, points, sizes, sweep)
    every = tuple(sample for row in cells for cell in row for sample in cell)
    # (a run may come to rest where no state was found)
    names = tuple(dict.fromkeys((*base.names, *(sample.outcome for sample in every if sample.outcome))))
    shares = np.full((len(up.values), len(across.values), len(names)), np.nan)
    uncertainty, runs = np.full(shares.shape[:2], np.nan), np.zeros(shares.shape[:2], dtype=np.int64)
    outcome = np.empty(shares.shape[:2], dtype="<U10")
    for j, row in enumerate(cells):
        for i, cell in enumerate(row):
            counts = [sum(sample.outcome == name for sample in cell) for name in names]
            runs[j, i] = total = sum(counts)
            if total:
                shares[j, i] = np.array(counts) / total
            uncertainty[j, i] = half_interval(max(counts, default=0), total)
            outcome[j, i] = name_of_cell(cell, len(cell) >= samples, axes)
    usual = base.over == RATE_AND_DAMPING and not base.selection
    curves = predictions(base, across.values, up.values) if usual else Curves()
    return Diagram(
        kind="selection" if base.selection else "skipping",
        x=across.values,
        y=up.values,
        outcomes=names,
        shares=shares,
        uncertainty=uncertainty,
        runs=runs,
        outcome=outcome,
        failed=tuple(Failed(s.x, s.y, s.reason) for s in every if not s.outcome),
        boundaries=_boundaries(base, axes, outcome, sweep) if boundaries else (),
        samples=every,
        folds=tuple(fold.control for fold in base.folds),
        predicted=curves,
        unpredicted=getattr(curves, "missing", {}),
        scene=scene,
        model=model,
        options=dict(options),
        seed=seed,
        over=base.over,
    )


def _over_rate_and_damping(rates: object, dampings: object) -> tuple[Axis, Axis]:
    return axis_of("rate", rates, "rates"), axis_of("damping", dampings, "dampings")


def outcome_diagram(
    scene: Scene,
    over: Mapping[str, tuple[float, float, int]],
    *,
    model: str = "der",
    samples: int = SAMPLES,
    boundaries: bool = True,
    seed: int = 0,
    sweep: Sweep | None = None,
    **options: Any,
) -> Diagram:
    """What ramps of a scene do, over any two numbers of it.

    Parameters
    ----------
    scene: at a positive rate; all its numbers but two.  Without a `stop` it is asked which shape is skipped
        (`skipping_diagram`), with one, or where that varies, in which it ends (`selection_diagram`).
    over: names of two numbers, across and up, and (low, high, count) of each: "rate", "damping",
        "compression", "shear", "stop"; of the ribbon "length", "width", "thickness", "young", "density",
        "bending_ratio", "twist_ratio", "curvature", "twist"; or a control that does not move, which is then
        preset: "left", "right", "twist_left", "twist_right", "lift", "force".  Rates, dampings, sizes and
        moduli are counted by factors, centres at low (high/low)^(k/(count - 1)); others by differences.
    model, samples, boundaries, seed, sweep, options: as in `skipping_diagram`.

    Returns
    -------
    `Diagram`.  Its outcomes have "no state" too, where the ribbon has not got its start, or nothing to skip;
        `samples` say why.  Folds and states are found anew for each run, but where rate and damping vary.

    Raises
    ------
    SceneError, OptionError, SolverError, SweepError
        As `skipping_diagram` does; for names that the scene has not, or that it moves; for a corner of the
        diagram at which there can be no scene.

    Examples
    --------
    >>> from compare import outcome_diagram
    >>> from ribbonfem import Scene
    >>> ramp = Scene(compression=0.40, shear=0.40, start="U+S+", rate=0.5, damping=10.0)
    >>> grid = {"shear": (0.38, 0.41, 2), "rate": (0.1, 1.0, 2)}
    >>> diagram = outcome_diagram(ramp, grid, nodes=31, samples=1, boundaries=False)
    >>> diagram.outcome.shape
    (2, 2)
    """
    a_scene("scene", scene)
    if scene.schedule is not None or scene.rate < 0.0:
        raise SceneError(
            f"Scene.schedule = {scene.schedule!r}: the rates of a diagram are constant"
            if scene.schedule is not None
            else f"Scene.rate = {scene.rate!r}: say by the drive which way it goes, as Drive(left=-1)"
        )
    return _diagram(scene, axes_of(scene, over), model, samples, boundaries, seed, sweep, options)


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
    return _diagram(
        scene, _over_rate_and_damping(rates, dampings), model, samples, boundaries, seed, sweep, options
    )


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
    return _diagram(
        scene, _over_rate_and_damping(rates, dampings), model, samples, boundaries, seed, sweep, options
    )


def both(diagrams: Mapping[str, Diagram]) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """(m, n) where the shares of two models are further apart than their intervals allow."""
    one, two = diagrams.values()
    apart = np.nanmax(np.abs(np.array(one.shares) - np.array(two.shares)), axis=2)
    return np.asarray(apart > np.array(one.uncertainty) + np.array(two.uncertainty))


__all__ = ["MODELS", "SAMPLES", "both", "outcome_diagram", "selection_diagram", "skipping_diagram"]
