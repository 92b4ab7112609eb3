"""Results as tables of other programs: `pandas.DataFrame` and `xarray.Dataset`, with their units."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from ribbonfem import Branch, History

# of every column: what it is, and its unit
_COLUMNS = {
    "time": ("time", "s"),
    "angle": ("angle of the turned clamp", "rad"),
    "height": ("z at midspan", "L"),
    "slope": ("z-component of the tangent at midspan", "1"),
    "load": ("compressive force along x", "EI2/L^2"),
    "stable": ("whether the equilibrium is stable", "1"),
    "energy": ("elastic energy", "EI2/L"),
    "kinetic": ("kinetic energy", "EI2/L"),
    "elastic": ("elastic energy", "EI2/L"),
    "dissipated": ("energy that damping took", "EI2/L"),
    "work": ("work of the clamp", "EI2/L"),
    "positions": ("positions of the nodes", "L"),
    "normals": ("unit vectors m1 normal to the surface", "1"),
    "s": ("arclength of the nodes", "L"),
}
_STATES = ("angle", "height", "slope", "load")
_REST = (*_STATES, "energy")


def _library(name: str, method: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        raise ImportError(
            f"{method} needs {name}, which is not installed: pip install {name}, or this package with "
            "its extra [frames]"
        ) from None


def _about(result: History | Branch) -> dict[str, Any]:
    """What a table keeps of where it is from: words, as files of other programs take them."""
    return {"model": result.model, "scene": repr(result.scene), "policy": repr(dict(result.policy))}


def _motion(history: History) -> dict[str, Any]:
    columns = {name: np.array(getattr(history, name)) for name in ("time", *_STATES)}
    return columns | {name: np.array(energy) for name, energy in history.energies.items()}


def _branch(branch: Branch) -> dict[str, Any]:
    return {name: np.array(getattr(branch, name)) for name in (*_REST, "stable")}


def _frame(result: History | Branch, columns: dict[str, Any]) -> Any:
    frame = _library("pandas", "to_pandas").DataFrame(columns)
    units = {name: _COLUMNS[name][1] for name in columns if name in _COLUMNS}
    frame.attrs.update(_about(result), units=units)
    return frame


def motion_frame(history: History) -> Any:
    """A motion as a `pandas.DataFrame`, a row an accepted step.

    Returns
    -------
    Columns time (s), angle (rad), height (L), slope, load (EI2/L^2), and the energies (EI2/L); `attrs`
    has the units by column, and model, scene and policy.

    Raises
    ------
    ImportError
        If pandas is not installed; says how to install it.
    """
    return _frame(history, _motion(history))


def branch_frame(branch: Branch) -> Any:
    """A curve of equilibria as a `pandas.DataFrame`, a row a point.

    Returns
    -------
    Columns angle (rad), height (L), slope, load (EI2/L^2), energy (EI2/L), stable; `attrs` has the units
    by column, the angles of the folds (rad), and model, scene and policy.

    Raises
    ------
    ImportError
        If pandas is not installed; says how to install it.
    """
    frame = _frame(branch, _branch(branch))
    frame.attrs["folds"] = [float(fold.angle) for fold in branch.folds]
    return frame


def _dataset(result: History | Branch, along: str, columns: dict[str, Any], shapes: dict[str, Any]) -> Any:
    """Columns along one dimension, and arrays (rows, nodes, 3) and others of the shapes."""
    xarray = _library("xarray", "to_xarray")
    nodes = len(result.arclength)

    def described(name: str, dims: tuple[str, ...], values: Any) -> Any:
        told = _COLUMNS.get(name)
        return (dims, values, {"long_name": told[0], "units": told[1]} if told else {})

    def dims(name: str, shape: tuple[int, ...]) -> tuple[str, ...]:
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
        coordinates["axis"] = ["x", "y", "z"]
    return xarray.Dataset(variables, coordinates, _about(result))


def motion_dataset(history: History) -> Any:
    """A motion as an `xarray.Dataset` along `time`.

    Returns
    -------
    Variables angle, height, slope, load and the energies, (time,), and the configurations, of which
    positions are (time, node, axis) in L; coordinates time (s), s (node,) in L, axis. Each has its
    `units`; the set has model, scene and policy.

    Raises
    ------
    ImportError
        If xarray is not installed; says how to install it.
    """
    return _dataset(history, "time", _motion(history), dict(history.configurations))


def branch_dataset(branch: Branch) -> Any:
    """A curve of equilibria as an `xarray.Dataset` along `row`, in the order of the curve.

    Returns
    -------
    Variables angle, height, slope, load, energy and stable, (row,), and positions, (row, node, axis) in L;
    coordinates s (node,) in L, axis. Each has its `units`; the set has folds (rad), model, scene, policy.

    Raises
    ------
    ImportError
        If xarray is not installed; says how to install it.
    """
    shapes = {} if branch.configurations is None else {"positions": branch.configurations}
    found = _dataset(branch, "row", _branch(branch), shapes)
    found.attrs["folds"] = [float(fold.angle) for fold in branch.folds]
    return found
