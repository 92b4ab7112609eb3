"""`convergence`: any quantity of any model under refinement of mesh or step, with order and limit.

    from compare import convergence
    print(convergence(elastica, scene, "fold", over={"elements": (8, 16, 32)}))
    convergence("der", scene, "snap", over={"step": (8e-3, 4e-3, 2e-3)}, method="newmark", nodes=51).order

Errors are taken against a reference that is given, or against Richardson's limit, which says
whether it is verified: whether the differences between runs fall as they should.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

import numpy as np

from compare.limits import ROUNDING, Limit, Value, richardson, root_mean_square
from compare.models import MODEL_INFO
from ribbonfem import Scene
from ribbonfem.frozen import called_later, html_table
from ribbonfem.options import OptionError, a_scene, number, positive, whole_number
from ribbonfem.results import Array
from ribbonfem.results import Value as Record
from ribbonfem.scene import shown

from .measure import (
    MESHES,
    MODELS,
    QUANTITIES,
    REFINABLE,
    Quantity,
    Shape,
    forget,
    name_of,
    order_of,
    require_monotone,
    require_options,
    size_of,
    unknowns,
)


@dataclass(frozen=True, repr=False, eq=False)
class Convergence(Record):
    """A quantity of a model under refinement, the coarsest first.

    Attributes
    ----------
    model, quantity: names; scene, options: what else the runs were made from.
    over: the option that was refined; at: (runs,) its values; sizes: (runs,) edge lengths in
        L, steps in s or tolerances in L.
    values: (runs,) numbers, or positions (points, 3) of shapes.
    limit: the reference that was given, or Richardson's limit.
    errors: (runs,) differences of the values from the limit, of shapes in L2.
    orders: observed; from each run to the next where a reference was given, else from each three.
    expected: the order that the model or the method declares; None for a tolerance.
    verified: whether the limit is: a reference is taken as it is, see `Limit` for Richardson's.
    uncertainty: of the limit; 0 for a reference.
    seconds: (runs,) CPU time of the solve; dofs: (runs,) degrees of freedom.
    """

    model: str
    scene: Scene
    quantity: str
    over: str
    at: tuple[float, ...]
    sizes: tuple[float, ...]
    values: tuple[Value, ...]
    limit: Value
    errors: Array
    orders: Array
    expected: float | None
    verified: bool
    uncertainty: float
    seconds: Array
    dofs: tuple[int, ...]
    given: bool
    options: Mapping[str, Any] = field(default_factory=dict)

    def plot(self, axes: Any = None, **options: Any) -> Any:
        """Draw it into axes of matplotlib, or new ones: see `ribbonfem.output.plots.convergence`."""
        return called_later("ribbonfem.output.plots:convergence", self, axes, **options)

    def to_pandas(self) -> Any:
        """As a `pandas.DataFrame`: see `ribbonfem.output.tables.convergence_frame`."""
        return called_later("ribbonfem.output.tables:convergence_frame", self)

    @property
    def order(self) -> float:
        """One order for all: the slope of log error over log size, or the one of the finest three runs.

        Errors at rounding, or below the limit's uncertainty, are left out of the slope.
        """
        if not self.given:
            return float(self.orders[-1])
        floor = max(ROUNDING * max(1.0, root_mean_square(self.limit)), self.uncertainty)
        keep = self.errors > floor
        if keep.sum() < 2:
            return math.nan
        return float(np.polyfit(np.log(np.array(self.sizes)[keep]), np.log(self.errors[keep]), 1)[0])

    def table(self) -> str:
        """The runs as lines of text."""
        head = f"{self.over:>10} {'size':>10} {'dofs':>6} {'error':>10} {'order':>6} {'CPU s':>8}"
        skip = len(self.at) - len(self.orders)
        lines = [head]
        for k, value in enumerate(self.at):
            order = f"{self.orders[k - skip]:6.2f}" if k >= skip else f"{'':6}"
            lines.append(
                f"{value:10g} {self.sizes[k]:10.3e} {self.dofs[k]:6d} {self.errors[k]:10.3e} {order} "
                f"{self.seconds[k]:8.4f}"
            )
        return "\n".join(lines)

    def __str__(self) -> str:
        expected = "none declared" if self.expected is None else f"{self.expected:g} declared"
        kind = "reference" if self.given else "limit, verified" if self.verified else "limit, NOT verified"
        limit = "" if np.ndim(self.limit) else f" {self.limit:.12g}"
        return (
            f"{self.quantity} of {self.model}, order {self.order:.2f} in {self.over} ({expected}); "
            f"{kind}{limit}\n{self.table()}"
        )

    def __repr__(self) -> str:
        return f"Convergence({self.model}, {self.quantity!r}, {self.over}={self.at}, order {self.order:.3g})"

    def _repr_html_(self) -> str:
        skip = len(self.at) - len(self.orders)
        orders = [""] * skip + [f"{order:.2f}" for order in self.orders]
        rows = zip(self.at, self.sizes, self.dofs, map(float, self.errors), orders, strict=True)
        caption = f"{str(self).splitlines()[0]}\n{self.scene.in_words}"
        return html_table(caption, (self.over, "size", "dofs", "error", "order"), rows)


def _over(name: str, function: str, over: Mapping[str, Sequence[float]], least: int) -> tuple[str, list[Any]]:
    """The option to refine and its values, the coarsest first."""
    if not isinstance(over, Mapping) or len(over) != 1 or next(iter(over)) not in REFINABLE:
        raise OptionError(
            f"over = {shown(over)}: must be a mapping of one of {', '.join(REFINABLE)} to its values"
        )
    key, given = next(iter(over.items()))
    listed = isinstance(given, (Sequence, Set)) or (isinstance(given, np.ndarray) and given.ndim == 1)
    if isinstance(given, (str, bytes)) or not listed:
        raise OptionError(f"{key} = {shown(given)}: the values to refine over are needed, three or so")
    require_options(name, function, {key: tuple(given)})
    values: list[Any] = sorted(
        {whole_number(key, value, 1) if key in MESHES else positive(key, value) for value in given},
        reverse=key not in MESHES,
    )
    if len(values) < least:
        raise OptionError(f"over = {shown(over)}: must have {least} different values of {key} at least")
    return key, values


def _function_of(quantity: Quantity, scene: Scene) -> str:
    """The function that a quantity is taken from: it decides which options there are."""
    if quantity.function == "either":
        return "folds" if scene.stop is None and scene.schedule is None else "simulate"
    return quantity.function


def _timed(quantity: Callable[..., Value]) -> Callable[[str, Scene, Mapping[str, Any]], tuple[Value, float]]:
    """A user's function as a measure: its value and the CPU seconds it took."""

    def measure(name: str, scene: Scene, options: Mapping[str, Any]) -> tuple[Value, float]:
        forget(name)
        begin = time.process_time()
        value = quantity(MODELS[name], scene, **options)
        return value, time.process_time() - begin

    return measure


def _common(shapes: Sequence[Shape]) -> Array:
    """The points of the coarsest shape that are points of all the others; all of its own if too few are.

    At a common point nothing is interpolated: on few points a spline is less exact than they are.
    """
    first = min(shapes, key=lambda shape: len(shape.s)).s
    inside = first[(first > -1e-12) & (first < 1.0 + 1e-12)]
    shared = np.array([s for s in inside if all(np.abs(shape.s - s).min() < 1e-12 for shape in shapes)])
    return shared if len(shared) >= 5 else inside


def _on(points: Array, value: Any) -> Value:
    return np.asarray(value.at(points)) if isinstance(value, Shape) else value


def convergence(
    model: ModuleType | str,
    scene: Scene,
    quantity: str | Callable[..., Value],
    over: Mapping[str, Sequence[float]],
    *,
    reference: Any = None,
    **options: Any,
) -> Convergence:
    """Refine one option and see how fast a quantity converges.

    Parameters
    ----------
    model: quasilinear, elastica, kirchhoff or der, the module or its name.
    scene: see `ribbonfem.Scene`; quantities of a motion need its `stop`.
    quantity: a name in `measure.QUANTITIES` ("fold", "first fold", "snap", "first snap",
        "shape", "energy", "height", "balance"), or a function, called as quantity(model, scene,
        **options) with the model's module, that returns a number or an array.
    over: one of "elements", "nodes", "step", "tolerance" and its values, in any order.
    reference: a number, an array or a `Shape` to take errors against; None for Richardson's limit,
        which needs three values.  Shapes are compared where their meshes have points in common, or
        else on those of the coarsest, by quintic splines.
    options: anything else that the function takes, the same in all runs.

    Raises
    ------
    OptionError
        If the model does not have a quantity, does not take these options or cannot be refined so; the
        message names it and what is allowed.
    SceneError, SolverError
        From the runs.
    """
    name = name_of(model)
    a_scene("scene", scene)
    if callable(quantity):
        function = "simulate" if isinstance(over, Mapping) and {"step", "tolerance"} & set(over) else "folds"
        label = str(getattr(quantity, "__name__", "quantity"))
        result = Quantity(label, _timed(quantity), function)
    elif isinstance(quantity, str) and quantity in QUANTITIES:
        require_monotone(scene, quantity)
        result, label = QUANTITIES[quantity], quantity
        function = _function_of(result, scene)
    else:
        raise OptionError(f"quantity = {shown(quantity)}: must be one of {', '.join(map(repr, QUANTITIES))}")
    if reference is None:
        reference = result.exact
    elif not isinstance(reference, (Shape, np.ndarray)):
        reference = number("reference", reference)
    key, values = _over(name, function, over, 3 if reference is None else 2)
    if not callable(quantity):
        require_options(name, function, options)
        declared = MODEL_INFO[name]
        if key == "tolerance" and declared.settled is not None and options.get(declared.mesh) is None:
            # one mesh for all: which one a motion takes by itself depends on its tolerance
            options = {**options, declared.mesh: declared.settled(scene, min(values), options.get("initial"))}
    # compiled before any clock starts
    result.measure(name, scene, {**options, key: values[0]})
    raw, seconds = zip(*(result.measure(name, scene, {**options, key: v}) for v in values), strict=True)
    sizes = [size_of(name, key, value, options, scene) for value in values]
    expected = order_of(name, key, options)
    points, spacing = np.zeros(0), 1.0
    if isinstance(raw[0], Shape):
        points = _common([*raw, reference] if isinstance(reference, Shape) else list(raw))
        # the length of a difference, its root mean square over the points: the L2 norm
        spacing = math.sqrt(3.0)
    compared = tuple(_on(points, value) for value in raw)
    if reference is not None:
        target = _on(points, reference)
        limit = Limit(target, np.zeros(0), True, 0.0)
    else:
        limit = richardson(compared, sizes, expected)
    errors = np.array([spacing * root_mean_square(np.subtract(value, limit.value)) for value in compared])
    with np.errstate(divide="ignore", invalid="ignore"):
        pairs = np.array(
            [
                np.log(errors[k] / errors[k + 1]) / np.log(sizes[k] / sizes[k + 1])
                for k in range(len(errors) - 1)
            ]
        )
    return Convergence(
        model=name,
        scene=scene,
        quantity=label,
        over=key,
        at=tuple(values),
        sizes=tuple(sizes),
        values=compared,
        limit=limit.value,
        errors=errors,
        orders=limit.orders if reference is None else pairs,
        expected=expected,
        verified=limit.verified,
        uncertainty=limit.uncertainty,
        seconds=np.array(seconds),
        dofs=tuple(
            unknowns(
                name,
                {**options, key: v},
                scene,
                function != "folds",
            )
            for v in values
        ),
        given=reference is not None,
        options=dict(options),
    )
