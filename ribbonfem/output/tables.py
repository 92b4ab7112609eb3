"""Results exported to `pandas.DataFrame` and `xarray.Dataset`, with units."""

from __future__ import annotations

from importlib import import_module
from itertools import product
from typing import Any

import numpy as np

from ribbonfem import Branch, FoldCurve, History, PitchforkCurve

# of every column: what it is, and its unit
_COLUMNS = {
    "time": ("time", "s"),
    "angle": ("angle of the turned clamp", "rad"),
    "control": ("what the drive moves", ""),
    "parameter": ("the second parameter", ""),
    "arclength": ("arclength of the curve", "1"),
    "height": ("z at midspan", "L"),
    "slope": ("z-component of the tangent at midspan", "1"),
    "velocity": ("velocity of midspan along z", "L/s"),
    "load": ("compressive force along x", "EI2/L^2"),
    "stable": ("whether the equilibrium is stable", "1"),
    "energy": ("elastic energy", "EI2/L"),
    "kinetic": ("kinetic energy", "EI2/L"),
    "elastic": ("elastic energy", "EI2/L"),
    "potential": ("energy of the weight", "EI2/L"),
    "dissipated": ("energy that damping and retardation took", "EI2/L"),
    "work": ("work of the controls", "EI2/L"),
    "positions": ("positions of the nodes", "L"),
    "normals": ("unit vectors m1 normal to the surface", "1"),
    "curvature": ("curvature about the width", "1/L"),
    "velocities": ("velocities of the nodes", "L/s"),
    "force": ("force of a clamp on the ribbon", "EI2/L^2"),
    "moment": ("moment of a clamp on the ribbon about its own point", "EI2/L"),
    "s": ("arclength of the nodes", "L"),
}
_STATES = ("height", "slope", "load")
_CLAMPS, _AXES = ("left", "right"), ("x", "y", "z")


def library(name: str, method: str) -> Any:
    """A library that a method needs, or an `ImportError` that says how to install it."""
    try:
        return import_module(name)
    except ImportError:
        raise ImportError(
            f"{method} needs {name}, which is not installed: pip install {name}, or this package with "
            "its extra [frames]"
        ) from None


def _about(result: Any) -> dict[str, Any]:
    """What a table keeps of where it is from: words, as files of other programs take them."""
    return {"model": result.model, "scene": repr(result.scene), "policy": repr(dict(result.options))}


def _motion(history: History) -> dict[str, Any]:
    names = ("time", _control(history), *_STATES, "velocity")
    columns = {name: np.array(getattr(history, name)) for name in names}
    return columns | {name: np.array(energy) for name, energy in history.energies.items()}


def _reactions(history: History) -> dict[str, Any]:
    """Force and moment (rows, 2, 3) of both clamps."""
    reactions = np.array(history.reactions)
    return {"force": reactions[..., :3], "moment": reactions[..., 3:]}


def _branch(branch: Branch) -> dict[str, Any]:
    names = (_control(branch), *_STATES, "energy", "stable")
    return {name: np.array(getattr(branch, name)) for name in names}


def _control(result: Any) -> str:
    """The column of the control: "angle" where clamps turn."""
    return "angle" if result.scene is None or result.scene.clamps_turn else "control"


def _unit(name: str, result: Any) -> str:
    name = name.split("_")[0]
    if name == "parameter":
        return result.unit
    return result.scene.drives.unit if name == "control" else _COLUMNS[name][1]


def _frame(result: Any, columns: dict[str, Any]) -> Any:
    frame = library("pandas", "to_pandas").DataFrame(columns)
    units = {name: _unit(name, result) for name in columns if name.split("_")[0] in _COLUMNS}
    frame.attrs.update(_about(result), units=units)
    return frame


def motion_frame(history: History) -> Any:
    """A motion as a `pandas.DataFrame`, a row an accepted step.

    Returns
    -------
    Columns time (s), angle (rad; of other drives control), height (L), slope, load (EI2/L^2), velocity
    (L/s), energies, force_left_x (EI2/L^2) to moment_right_z (EI2/L) of the clamps; `attrs`
    has the units by column, and model, scene and options.

    Raises
    ------
    ImportError
        If pandas is not installed; says how to install it.
    """
    columns = _motion(history)
    for name, values in _reactions(history).items():
        for (j, clamp), (k, axis) in product(enumerate(_CLAMPS), enumerate(_AXES)):
            columns[f"{name}_{clamp}_{axis}"] = values[:, j, k]
    return _frame(history, columns)


def branch_frame(branch: Branch) -> Any:
    """A curve of equilibria as a `pandas.DataFrame`, a row a point.

    Returns
    -------
    Columns angle (rad; of other drives control), height (L), slope, load (EI2/L^2), energy
    (EI2/L), stable; `attrs` has the units
    by column, the controls of the folds, and model, scene and options.

    Raises
    ------
    ImportError
        If pandas is not installed; says how to install it.
    """
    frame = _frame(branch, _branch(branch))
    frame.attrs["folds"] = [float(fold.control) for fold in branch.folds]
    return frame


def _curve(curve: FoldCurve | PitchforkCurve) -> dict[str, Any]:
    names = ("parameter", _control(curve), "height", "load", "stable", "arclength")
    return {name: np.array(getattr(curve, name)) for name in names}


def _marks(curve: FoldCurve | PitchforkCurve) -> dict[str, Any]:
    """Words and numbers of a curve that are no column: its parameter, where it turns back, its error."""
    cusps = curve.cusps if isinstance(curve, FoldCurve) else ()
    marks = {"cusps": cusps, "turns": curve.turns}
    points = {name: [float(mark.parameter) for mark in of] for name, of in marks.items()}
    return {"over": curve.over, "error": float(curve.error)} | points


def curve_frame(curve: FoldCurve | PitchforkCurve) -> Any:
    """A curve in two parameters as a `pandas.DataFrame`, a row a point.

    Returns
    -------
    Columns parameter (its unit), angle (rad; of other drives control), height (L), load (EI2/L^2), stable,
    arclength; `attrs` has the units by column, the name of the parameter, its values at cusps and turns, the
    error between rows, and model, scene and options.

    Raises
    ------
    ImportError
        If pandas is not installed; says how to install it.
    """
    frame = _frame(curve, _curve(curve))
    frame.attrs.update(_marks(curve))
    return frame


def curve_dataset(curve: FoldCurve | PitchforkCurve) -> Any:
    """A curve in two parameters as an `xarray.Dataset` along `row`.

    Returns
    -------
    Variables and attributes are columns and `attrs` of `curve_frame`; each variable has its `units`.

    Raises
    ------
    ImportError
        If xarray is not installed; says how to install it.
    """
    result = _dataset(curve, "row", _curve(curve), {})
    result.attrs.update(_marks(curve))
    return result


def convergence_frame(result: Any) -> Any:
    """A `Convergence` as a `pandas.DataFrame`, a row a run, the coarsest first.

    Returns
    -------
    Columns: what was refined, under its own name; size (edge length or tolerance in L, step in s), dofs,
    value where it is a number, error, order (NaN where too few runs come before it), seconds (CPU). `attrs`
    has the units by column, quantity, limit, whether it is verified, its uncertainty, model, scene, options.

    Raises
    ------
    ImportError
        If pandas is not installed; says how to install it.
    """
    pandas = library("pandas", "to_pandas")
    skipped = len(result.at) - len(result.orders)
    columns: dict[str, Any] = {
        result.over: list(result.at),
        "size": list(result.sizes),
        "dofs": list(result.dofs),
    }
    number = not np.ndim(result.limit)
    if number:
        columns["value"] = [float(value) for value in result.values]
    columns["error"] = np.array(result.errors)
    columns["order"] = [np.nan] * skipped + [float(order) for order in result.orders]
    columns["seconds"] = np.array(result.seconds)
    frame = pandas.DataFrame(columns)
    frame.attrs.update(
        units={"size": "s" if result.over == "step" else "L", "seconds": "s"},
        quantity=result.quantity,
        limit=float(result.limit) if number else np.array(result.limit).tolist(),
        verified=bool(result.verified),
        uncertainty=float(result.uncertainty),
        **_about(result),
    )
    return frame


def fit_frame(result: Any) -> Any:
    """A `Fit` as a `pandas.DataFrame`, a row a datum, in the units of what was measured.

    Returns
    -------
    Columns scene (its number, from 0), quantity, over (its time, or its control at rest; NaN of events),
    measured, predicted, residual, uncertainty, unit; `attrs` has values, uncertainty and model_error by name,
    chi2, degrees, converged, and model, scene and options.

    Raises
    ------
    ImportError
        If pandas is not installed; says how to install it.
    """
    pandas = library("pandas", "to_pandas")
    parts = []
    for k, (data, left) in enumerate(zip(result.measured, result.residual, strict=True)):
        for name in left:
            rows = name in data.columns
            over = (data.values("time" if data.time is not None else "control")) if rows else np.nan
            columns = {"scene": k, "quantity": name, "over": over, "measured": data.values(name)}
            columns |= {"predicted": np.array(result.predicted[k][name]), "residual": left[name]}
            columns |= {"uncertainty": np.array(result.sigma[k][name])}
            unit = data.unit(name, result.scenes[k].drives.unit)
            parts.append(pandas.DataFrame(columns | {"unit": unit}))
    frame = pandas.concat(parts, ignore_index=True)
    named = {name: dict(getattr(result, name)) for name in ("values", "uncertainty", "model_error")}
    facts = {name: getattr(result, name) for name in ("chi2", "degrees", "converged")}
    frame.attrs.update(named, **facts, **_about(result))
    return frame


def _dataset(result: Any, along: str, columns: dict[str, Any], shapes: dict[str, Any]) -> Any:
    """Columns along one dimension, and arrays (rows, nodes, 3) and others of the shapes."""
    xarray = library("xarray", "to_xarray")
    nodes = len(result.arclength)

    def described(name: str, dims: tuple[str, ...], values: Any) -> Any:
        if name not in _COLUMNS:
            return dims, values, {}
        return dims, values, {"long_name": _COLUMNS[name][0], "units": _unit(name, result)}

    def dims(name: str, shape: tuple[int, ...]) -> tuple[str, ...]:
        if name in ("force", "moment"):
            return along, "clamp", "axis"
        # what a model has between its nodes, or of other lengths, has dimensions of its own
        inner = ["node" if size == nodes else f"{name}_{k}" for k, size in enumerate(shape[1:2], 1)]
        inner += ["axis" if size == 3 else f"{name}_{k}" for k, size in enumerate(shape[2:3], 2)]
        inner += [f"{name}_{k}" for k in range(3, len(shape))]
        return (along, *inner)

    variables = {name: described(name, (along,), values) for name, values in columns.items() if name != along}
    for name, values in shapes.items():
        array = np.array(values)
        variables[name] = described(name, dims(name, array.shape), array)
    coordinates: dict[str, Any] = {}
    if along in columns:
        coordinates[along] = described(along, (along,), columns[along])
    if shapes:
        coordinates["s"] = described("s", ("node",), np.array(result.arclength))
        coordinates["axis"] = list(_AXES)
    if "force" in shapes:
        coordinates["clamp"] = list(_CLAMPS)
    return xarray.Dataset(variables, coordinates, _about(result))


def motion_dataset(history: History) -> Any:
    """A motion as an `xarray.Dataset` along `time`.

    Returns
    -------
    Variables angle, height, slope, load, velocity and the energies, (time,); force (EI2/L^2) and moment
    (EI2/L) of the clamps on the ribbon, (time, clamp, axis); and the configurations, of which positions are
    (time, node, axis) in L; coordinates time (s), s (node,) in L, axis, clamp. Each has its `units`; the
    set has model, scene and options.

    Raises
    ------
    ImportError
        If xarray is not installed; says how to install it.
    """
    return _dataset(history, "time", _motion(history), _reactions(history) | dict(history.configurations))


def branch_dataset(branch: Branch) -> Any:
    """A curve of equilibria as an `xarray.Dataset` along `row`, in the order of the curve.

    Returns
    -------
    Variables angle, height, slope, load, energy and stable, (row,), positions, (row, node, axis) in L, and
    normals, of a ribbon in three dimensions; coordinates s (node,) in L, axis. Each has its `units`; the
    set has folds (rad), model, scene, options.

    Raises
    ------
    ImportError
        If xarray is not installed; says how to install it.
    """
    shapes = {"positions": branch.configurations, "normals": branch.normals}
    shapes = {name: rows for name, rows in shapes.items() if rows is not None}
    result = _dataset(branch, "row", _branch(branch), shapes)
    result.attrs["folds"] = [float(fold.control) for fold in branch.folds]
    return result
