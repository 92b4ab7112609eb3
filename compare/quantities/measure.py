"""Quantities of any model (fold, snap, shape, energy) with their CPU time, by its public functions alone.

Every measure goes through the functions of a model and nothing else of it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType, ModuleType
from typing import Any, cast

import numpy as np
from scipy.interpolate import make_interp_spline

from compare.models import MODEL_INFO, MODELS
from ribbonfem import History, Scene, SolverError, kirchhoff
from ribbonfem.model_info import defaults
from ribbonfem.options import OptionError, refuse
from ribbonfem.results import Array, Fold, Value, control_text
from ribbonfem.scene import shown

MESHES = ("elements", "nodes")
# what an option can be refined in
REFINABLE = (*MESHES, "step", "tolerance")
# a ramp this short (rad) leaves the ribbon where it was
_STILL = 1e-9


def name_of(model: ModuleType | str) -> str:
    """The name of a model, given as its module or by that name.

    Raises
    ------
    OptionError
        If it is neither.
    """
    for name, module in MODELS.items():
        if model is module or (isinstance(model, str) and model == name):
            return name
    raise OptionError(f"model = {shown(model)}: must be one of {', '.join(MODELS)} (the module or its name)")


def function_of(name: str, function: str) -> Callable[..., Any]:
    """A function of a model.

    Raises
    ------
    OptionError
        If the model does not have it.
    """
    result = getattr(MODELS[name], function, None)
    if result is None:
        raise OptionError(f"model = {name!r}: has no {function}; it is static")
    return cast(Callable[..., Any], result)


def defaults_of(name: str, function: str) -> Mapping[str, Any]:
    """The names of the options of a function, with their defaults, from its signature."""
    function_of(name, function)
    return defaults(MODELS[name], function)


def require_options(name: str, function: str, options: Mapping[str, Any], taken: Sequence[str] = ()) -> None:
    """Raise a `OptionError` that names the first of `options` which the function of the model does not take.

    `taken`: keywords of the function that the caller says itself.
    """
    allowed = [key for key in defaults_of(name, function) if key not in taken]
    for key, value in options.items():
        if key not in allowed:
            raise OptionError(f"{key} = {shown(value)}: {name}.{function} takes {', '.join(allowed)}")


def mesh_of(name: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """The part of options that is about the discretisation in space."""
    mesh = defaults_of(name, "folds")
    return {key: value for key, value in options.items() if key in mesh and key != "steps"}


def unknowns(name: str, options: Mapping[str, Any], scene: Scene, dynamic: bool) -> int:
    """Degrees of freedom of a model at rest or in motion, with the defaults for what is not given.

    At rest: free dofs and multipliers.  In motion elements have positions and forces too.
    """
    declared = MODEL_INFO[name]
    full = {**defaults_of(name, "simulate" if dynamic else "folds"), **options}
    if full[declared.mesh] is None and declared.settled is not None:
        stepping = any(options.get(name) is not None for name in ("tolerance", "step"))
        # (steps that are given have no tolerance)
        full[declared.mesh] = declared.settled(scene, *([options.get("tolerance")] if stepping else []))
    return declared.in_motion(full) if dynamic else declared.at_rest(full)


def size_of(name: str, over: str, value: float, options: Mapping[str, Any], scene: Scene) -> float:
    """The size that goes to zero as `over` is refined: edge length (L), step (s) or tolerance (L)."""
    if over in MESHES:
        return MODEL_INFO[name].size({**options, over: value})
    if over == "step" and name != "der" and scene.stop is not None:
        # elements shorten a step so that a whole number of them fits the ramp
        ramp = scene.stop / scene.rate
        return ramp / math.ceil(ramp / value - 1e-9)
    return float(value)


def order_of(name: str, over: str, options: Mapping[str, Any]) -> float | None:
    """The order that model or method declares; None for a tolerance."""
    declared = MODEL_INFO[name]
    if over in MESHES:
        return declared.order(options)
    if over == "step":
        method = str(options.get("method", defaults_of(name, "simulate")["method"]))
        return float(declared.methods[method]) if method in declared.methods else None
    return None


@dataclass(frozen=True, eq=False)
class Shape(Value):
    """A configuration: arclength (points,) of material points in [0, 1] and positions (points, 3) in L."""

    s: Array
    r: Array

    def at(self, s: Array) -> Array:
        """Positions (len(s), 3) at other arclengths, on the quintic spline through the points."""
        degree = 5 if len(self.s) > 5 else 3
        return np.asarray(make_interp_spline(self.s, self.r, k=degree)(s))

    def distance(self, reference: Shape) -> float:
        """L2 norm over the arclength of the difference from a finer one, at the points of this one."""
        inside = (self.s > -1e-12) & (self.s < 1.0 + 1e-12)
        s, off = self.s[inside], (self.r[inside] - reference.at(self.s[inside])) ** 2
        return float(np.sqrt(np.trapezoid(off.sum(axis=1), s)))


def step_at(history: History, angle: float) -> tuple[slice, Array]:
    """Rows around the instant at which the ramp reaches `angle`, and their weights in cubic interpolation.

    Raises
    ------
    SolverError
        If it was not reached.
    """
    if (
        not min(history.control[0], history.control[-1])
        <= angle
        <= max(history.control[0], history.control[-1])
    ):
        raise SolverError(
            f"the run ended at {control_text(history.scene, history.control[-1])}, before {angle:.6g}"
        )
    along = np.abs(history.control)
    k = int(np.searchsorted(along, abs(angle)))
    first = min(max(k - 2, 0), max(len(along) - 4, 0))
    rows = slice(first, first + min(4, len(along)))
    x = along[rows]
    weights = np.array(
        [
            np.prod([(abs(angle) - x[j]) / (x[i] - x[j]) for j in range(len(x)) if j != i])
            for i in range(len(x))
        ]
    )
    return rows, weights


def shape_at(history: History, name: str, angle: float) -> Shape:
    """The shape at the instant of the ramp at which the clamp has turned by `angle`."""
    rows, weights = step_at(history, angle)
    r = np.einsum("k,kij->ij", weights, history.configurations["positions"][rows])
    return Shape(history.arclength, r)


def energy_at(history: History, angle: float) -> float:
    """Kinetic and elastic energy (EI2/L) at that instant."""
    rows, weights = step_at(history, angle)
    return float(weights @ (history.energies["kinetic"][rows] + history.energies["elastic"][rows]))


def balance_of(history: History) -> float:
    """Largest defect (EI2/L) of kinetic + elastic + dissipated - work, which an exact motion keeps."""
    e = history.energies
    total = e["kinetic"] + e["elastic"] + e["potential"] + e["dissipated"] - e["work"]
    return float(np.abs(total - total[0]).max())


@dataclass(frozen=True, eq=False)
class Rest(Value):
    """A start state at alpha = 0: its shape, elastic energy (EI2/L) and z(1/2)/L."""

    shape: Shape
    energy: float
    height: float


def at_rest(name: str, scene: Scene, options: Mapping[str, Any]) -> Rest:
    """The start state of a scene in a model.

    Raises
    ------
    SceneError, OptionError, SolverError
        From the model.
    """
    require_options(name, "folds", options)
    if name == "kirchhoff":
        state = kirchhoff.state(scene, **options)
        # the ends of the elements, where all models have the order of their angles
        ends = slice(None, None, (len(state.s) - 1) // {**defaults_of(name, "folds"), **options}["elements"])
        return Rest(Shape(state.s[ends], state.positions[ends]), state.energy, state.height)
    # the first row of a motion is the start state itself
    still = replace(scene, rate=1.0, stop=_STILL, hold=0.0)
    history: History = function_of(name, "simulate")(still, **options)
    r = history.configurations["positions"][0]
    shape = Shape(history.arclength, r)
    return Rest(shape, float(history.energies["elastic"][0]), float(history.height[0]))


def run(name: str, scene: Scene, options: Mapping[str, Any]) -> tuple[History, float]:
    """`simulate`, and the CPU seconds of the time loop alone.

    Raises
    ------
    SceneError, OptionError, SolverError
        From the model.
    """
    simulate = function_of(name, "simulate")
    require_options(name, "simulate", options)
    begin = time.process_time()
    history: History = simulate(scene, **options)
    spent = time.process_time() - begin
    # the loop's clock is the wall's: where other programs delay it, the CPU time of the whole call is less
    return history, min(float(history.stats["seconds"]), spent)


# (model's name, scene, options) -> value and CPU seconds
Measure = Callable[[str, Scene, Mapping[str, Any]], tuple[Any, float]]


def forget(name: str) -> None:
    """Let a model forget the start states and folds that it keeps: a call that is timed would find them."""
    if kept := getattr(getattr(MODELS[name], "states", None), "forget", None):
        kept()


def _folds(name: str, scene: Scene, options: Mapping[str, Any]) -> tuple[tuple[Fold, ...], float]:
    require_options(name, "folds", options)
    forget(name)
    begin = time.process_time()
    result: tuple[Fold, ...] = function_of(name, "folds")(scene, **options)
    seconds = time.process_time() - begin
    if not result:
        raise SolverError("the ramp meets no fold")
    return result, seconds


def _fold(which: int) -> Measure:
    def measure(name: str, scene: Scene, options: Mapping[str, Any]) -> tuple[float, float]:
        result, seconds = _folds(name, scene, options)
        return result[which].control, seconds

    return measure


def fold_angles(name: str, scene: Scene, options: Mapping[str, Any]) -> tuple[Array, float]:
    """Angles of all the folds that the ramp meets, and CPU seconds."""
    result, seconds = _folds(name, scene, options)
    return np.array([fold.control for fold in result]), seconds


def _crossing(quantity: str, time_of: bool = False) -> Measure:
    def measure(name: str, scene: Scene, options: Mapping[str, Any]) -> tuple[float, float]:
        allowed = defaults_of(name, "simulate") if hasattr(MODELS[name], "simulate") else {}
        extra: dict[str, Any] = {"until": "snap"} if quantity == "height" else {}
        if "configurations" in allowed:
            extra["configurations"] = False
        history, seconds = run(name, scene, {**extra, **options})
        result = history.snap if quantity == "height" else history.crossing(quantity)
        if result is None:
            raise SolverError(
                f"the {quantity} does not change sign up to {control_text(scene, scene.require_stop())}"
            )
        if not time_of:
            require_moving(history, result[0], "snap" if quantity == "height" else "first snap")
        return result[0 if time_of else 1], seconds

    return measure


def require_monotone(scene: Scene, quantity: str) -> None:
    """Raise an `OptionError` where the control turns back, so that its value tells no instant of a snap."""
    if quantity in ("snap", "first snap") and scene.schedule is not None and not scene.schedule.monotone:
        refuse("quantity", quantity, "the control turns back, so that it tells no instant: 'snap time' does")


def require_moving(history: History, time: float, quantity: str) -> None:
    """Raise an `OptionError` where the control stands still at an instant that its value is to tell.

    (Of a ramp that is held at its stop the stop is the answer.)
    """
    if history.scene.schedule is not None and history.stands_still(time):
        refuse(
            "quantity",
            quantity,
            f"the control stands still when it comes, at {time:.6g} s, so that it tells no instant: "
            "'snap time' does",
        )


def _at(rest: str, end: Callable[[History, str], Any]) -> Measure:
    """What a scene without an end has at rest, by its name in `Rest`, and a motion at the end of its ramp."""

    def measure(name: str, scene: Scene, options: Mapping[str, Any]) -> tuple[Any, float]:
        if scene.stop is None and scene.schedule is None:
            forget(name)
            begin = time.process_time()
            value = getattr(at_rest(name, scene, options), rest)
            return value, time.process_time() - begin
        history, seconds = run(name, replace(scene, hold=0.0), options)
        return end(history, name), seconds

    return measure


def _last_energy(history: History, name: str) -> float:
    return float(history.energies["kinetic"][-1] + history.energies["elastic"][-1])


def _balance(name: str, scene: Scene, options: Mapping[str, Any]) -> tuple[float, float]:
    history, seconds = run(name, scene, options)
    return balance_of(history), seconds


@dataclass(frozen=True)
class Quantity:
    """A measure by name: `measure(model name, scene, options)` returns its value and CPU seconds.

    `function` is the one whose options it takes, "folds" or "simulate"; "either": by the scene, which has
    a `stop` or not.  `exact` is the value of an exact solution, where there is one for all.
    """

    text: str
    measure: Measure
    function: str
    exact: float | None = None


QUANTITIES: Mapping[str, Quantity] = MappingProxyType(
    {
        "fold": Quantity("angle (rad) of the last fold that a very slow ramp meets", _fold(-1), "folds"),
        "first fold": Quantity("angle (rad) of the first of them", _fold(0), "folds"),
        "snap": Quantity("angle (rad) of the ramp where z(1/2) = 0", _crossing("height"), "simulate"),
        "snap time": Quantity("time (s) of that instant", _crossing("height", True), "simulate"),
        "first snap": Quantity(
            "angle (rad) where the mid tangent has t_z = 0", _crossing("slope"), "simulate"
        ),
        "shape": Quantity(
            "positions (L): at the end of the ramp, or at rest, alpha = 0, in a scene without an end",
            _at(
                "shape", lambda history, _: Shape(history.arclength, history.configurations["positions"][-1])
            ),
            "either",
        ),
        "energy": Quantity(
            "kinetic and elastic energy (EI2/L), at the same instant as shape",
            _at("energy", _last_energy),
            "either",
        ),
        "height": Quantity(
            "z(1/2)/L, at the same instant as shape",
            _at("height", lambda history, name: float(history.height[-1])),
            "either",
        ),
        "balance": Quantity(
            "largest defect (EI2/L) of the energy balance of a run; 0 if exact", _balance, "simulate", 0.0
        ),
    }
)
