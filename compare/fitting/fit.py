"""`fit`: parameters of a scene from what was measured of it, by least squares, with uncertainties.

    data = Measured(time=t, height=z, uncertainty=1e-3)
    fit = compare.fit(scene, data, vary=("damping", "young"))
    fit.values["young"], fit.uncertainty["young"]

A prediction that comes of adaptive steps scatters by some of its tolerance as its parameters change: a small
step of a parameter would see the scatter and not the change.  Derivatives are central differences over half a
percent of each parameter, where the scatter counts little and the curvature (its square) not yet; and over
more, where a long vibration makes the scatter larger than what was measured is uncertain by.  What the
model's own error does to the values is measured at the end, by one refined run, and where it is not small,
the fit goes on with finer steps.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Any

import numpy as np
from scipy.optimize import OptimizeResult

from compare.models import MODEL_INFO
from compare.quantities.measure import defaults_of, name_of, require_options
from ribbonfem import Scene
from ribbonfem.measured import Measured
from ribbonfem.options import positive, refuse, whole_number
from ribbonfem.results import Array

from .inference import IN, Inference, infer
from .parameters import Parameter, applied, parameters_of
from .predictions import Model, Record
from .problem import WIDEST, Problem, deviations_of, records_of
from .result import SMALL, Fit

# part of a parameter over which derivatives are taken
STEP = 5e-3
# tolerances (L) of the first runs, as a part of the smallest uncertainty, and between these
_PART, _COARSEST, _FINEST = 1e-2, 1e-5, 1e-7
# how often a tolerance that is too large is made ten times smaller, if the model's error falls so far by it
_FINER, _WORTH = 2, 0.7
# how often estimated standard deviations are put in anew, and the change that ends it
_ROUNDS, _SETTLED = 8, 0.02
# a last step that would go less far, in standard deviations, is none
_LEFT = 0.1


def _model(
    records: tuple[Record, ...],
    parameters: tuple[Parameter, ...],
    sigma: list[dict[str, Array]],
    unknown: Mapping[str, str],
    model: ModuleType | str | None,
    options: Mapping[str, Any],
) -> Model:
    """The cheapest model that takes the scenes, also where what is varied has left its beginning."""
    moved = [p.start + STEP * p.size(p.start) for p in parameters]
    planar = all(applied(record.scene, parameters, moved).planar for record in records)
    name = name_of(model) if model is not None else "elastica" if planar else "kirchhoff"
    if MODEL_INFO[name].planar and not planar:
        refuse("model", name, "is planar, and what is varied leaves the plane: kirchhoff or der is needed")
    require_options(name, "simulate", options, ("initial", "until", "configurations", "every"))
    given = dict(options)
    if "extensible" in defaults_of(name, "simulate"):
        given.setdefault("extensible", True)
    # one mesh for all trials: which one a motion takes by itself depends on its scene
    mesh, settled = MODEL_INFO[name].mesh, MODEL_INFO[name].settled
    if given.get(mesh) is None:
        usual = defaults_of(name, "simulate" if any(record.moves for record in records) else "folds")[mesh]
        given[mesh] = settled(records[0].scene, None) if usual is None and settled else usual
    if given.get("step") is None and given.get("tolerance") is None:
        known = [
            float(np.nanmin(each[key])) * record.own(key, record.scene)
            for record, each in zip(records, sigma, strict=True)
            for key in each
            if key not in unknown and key in ("height", "midspan_x", "midspan_y", "snap", "first_snap")
        ]
        given["tolerance"] = float(f"{min(max(_PART * min(known, default=1.0), _FINEST), _COARSEST):.3g}")
    return Model(name, given)


def fit(
    scene: Scene | Sequence[Scene],
    measured: Measured | Sequence[Measured],
    vary: Sequence[str] | Mapping[str, tuple[float, float] | None] = ("damping",),
    *,
    model: ModuleType | str | None = None,
    difference: float = STEP,
    most: int = 60,
    **options: Any,
) -> Fit:
    """Fit parameters to what was measured, by least squares; they begin where the scene has them.

    Parameters
    ----------
    scene: what happened on the bench; or several scenes that share the parameters, each with its own
        `measured`.  A control that has reached its stop is held there as long as rows go on, or to the
        `snap_time`, and rests before it begins.
    measured: see `ribbonfem.measured.Measured`.
    vary: names of numbers of `Scene` ("damping", "compression", "shear", "rate", ...) and `Ribbon` ("young"
        or "ribbon.young", ...), a control that does not move and is preset ("lift", "right", ...), "offset"
        (s), by which the clock of `time` is ahead of the scene's; or a mapping of names to bounds (low, high)
        or None, which stands for the field's own.  An offset begins in the middle of its bounds.
    model: the module or its name; by default the elastica of planar scenes, else the Kirchhoff rod, both
        with stretch.
    difference: of derivatives, a part of each parameter.
    most: evaluations of a search.
    options: of the model's `simulate`; its mesh is that of states at rest too.  Without `tolerance` (or a
        fixed `step`, by `method`) that is a hundredth of the smallest uncertainty, or 1e-5 L, and is made
        smaller where the model's error turns out not to be small beside the uncertainty of the values.

    Returns
    -------
    `Fit`.

    Raises
    ------
    OptionError
        For what cannot be varied, bounds and options that cannot be, fewer data than parameters.
    SceneError, SolverError
        As the model does where the fit begins: for a scene that does not do what was measured, a unit that is
        not of the scene's control, an uncertainty that is needed.

    Examples
    --------
    >>> from ribbonfem import Scene
    >>> from ribbonfem.measured import Measured
    >>> beam = Scene(compression=0.40, shear=0.0, start="U+", rate=1.0, damping=1.0)
    >>> result = fit(beam, Measured(snap=1.32, uncertainty=1e-3), vary="damping")
    >>> round(result.values["damping"], 1), round(result.uncertainty["damping"], 2)
    (3.0, 0.15)
    """
    begin = time.process_time()
    records = records_of(scene, measured)
    clocks = [k for k, record in enumerate(records) if record.has_clock]
    parameters = parameters_of([record.scene for record in records], vary, clocks)
    part = positive("difference", difference, 0.1)
    most = whole_number("most", most, 1)
    sigma, unknown = deviations_of(records)
    chosen = _model(records, parameters, sigma, unknown, model, options)
    problem = Problem(records, parameters, chosen, part, sigma)
    at_rest = [mask["control"] for mask, record in zip(problem.masks, records, strict=True) if record.at_rest]
    # (where on its curve a state at rest is, is found too)
    moving = sum(int(mask.sum()) for mask in at_rest)
    degrees = problem.count - moving - len(parameters)
    if degrees < (1 if unknown else 0):
        refuse(
            "vary",
            tuple(p.name for p in parameters),
            f"{len(parameters)} numbers from {problem.count - moving} data"
            + (", and a standard deviation that is not given" if unknown else ""),
        )
    y = np.array([p.start for p in parameters]) / problem.scale
    # what cannot be run to begin with is told as the model tells it
    problem.residual(y)
    y = problem.off_symmetry(y)
    runs, before = 0, math.inf
    given = any(options.get(name) is not None for name in ("tolerance", "step"))
    for k in range(_FINER + 1):
        fine = problem.model.refined()
        problem.widen(y)
        minimum = _settled(problem, y, most, unknown, degrees)
        y = minimum.x
        statistics = _inference(problem, minimum, fine)
        runs += problem.model.runs + fine.runs
        coarse = statistics.coarse
        if given or coarse <= SMALL or coarse > _WORTH * before:
            break
        if k == _FINER or problem.model.options["tolerance"] <= _FINEST:
            break
        problem.model, before = fine, coarse
    return _result(problem, minimum, statistics, unknown, degrees, runs, time.process_time() - begin)


def _settled(
    problem: Problem, y: Array, most: int, unknown: Mapping[str, str], degrees: int
) -> OptimizeResult:
    """The minimum, with the standard deviations that are not given as what it leaves."""
    minimum = problem.minimum(y, most)
    # one that all share changes no minimum
    data = [record.measured for record in problem.records]
    alone = len({name for each in data for name in each.measured}) == 1 and not any(
        each.uncertainty for each in data
    )
    for _ in range(_ROUNDS if unknown else 0):
        change = problem.estimate(minimum.x, unknown, degrees)
        if alone or change < _SETTLED:
            break
        minimum = problem.minimum(minimum.x, most)
    return minimum


def _inference(problem: Problem, minimum: OptimizeResult, fine: Model) -> Inference:
    """What the minimum says, with the error of the model's predictions there."""
    y = minimum.x
    sizes, error, scatter = problem.sizes(y), problem.error(y, fine), problem.scatter(y)

    def inferred() -> Inference:
        slopes, residual = problem.jacobian(y) * sizes, problem.residual(y)
        free = ~problem.held(y, slopes.T @ residual)
        return infer(slopes, residual, error, scatter, problem.steps, free)

    result = inferred()
    if (problem.steps < min(result.wanted, WIDEST)).any():
        problem.steps[:] = np.maximum(problem.steps, min(result.wanted, WIDEST))
        result = inferred()
    return result


def _result(
    problem: Problem,
    minimum: OptimizeResult,
    statistics: Inference,
    unknown: Mapping[str, str],
    degrees: int,
    runs: int,
    seconds: float,
) -> Fit:
    y, names = minimum.x, [p.name for p in problem.parameters]
    units = problem.sizes(y) * problem.scale
    spread = np.sqrt(np.diag(statistics.covariance))
    with np.errstate(invalid="ignore"):
        correlation = statistics.covariance / np.outer(spread, spread)
    scenes, residual = problem.scenes(y), problem.residual(y)

    def named(values: Array) -> dict[str, float]:
        return {name: float(value) for name, value in zip(names, values, strict=True)}

    model, pairs = problem.model, tuple(zip(problem.records, scenes, strict=True))
    return Fit(
        values=named(problem.values(y)),
        uncertainty=named(spread * units),
        correlation=correlation,
        model_error=named(statistics.shift * units),
        undetermined=tuple(
            {name: float(x) for name, x in zip(names, direction, strict=True) if abs(x) > IN}
            for direction in statistics.undetermined
        ),
        at_bounds=tuple(name for name, mask in zip(names, problem.bound(y), strict=True) if mask),
        prediction_error=statistics.noise,
        converged=bool(minimum.status > 0 and statistics.left < _LEFT + statistics.blur),
        chi2=float(residual @ residual),
        degrees=degrees,
        estimated=tuple(unknown),
        predicted=tuple(problem.predicted(y)),
        sigma=tuple(problem.sigma),
        scenes=scenes,
        measured=tuple(record.measured for record in problem.records),
        begun=named(np.array([p.start for p in problem.parameters])),
        histories=tuple(
            record.history(model, scene, problem.offset(y, k)) for k, (record, scene) in enumerate(pairs)
        ),
        curves=tuple(record.curve(model, scene) for record, scene in pairs),
        model=model.name,
        options=model.options,
        runs=runs,
        seconds=seconds,
    )
