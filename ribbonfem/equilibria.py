"""Results at rest: a fold, an instability, a branch of equilibria, one state at rest.

All are frozen.  Lengths are in L, angles in rad, energies in EI2/L, forces in EI2/L^2.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .frozen import Value, called_later, html_table, short_options, some_rows
from .scene import Scene, SceneError

Array = NDArray[np.float64]


def name_and_unit(scene: Scene | None) -> tuple[str, str]:
    """Of a scene's control: alpha where only clamps turn."""
    return ("alpha", "rad") if scene is None or scene.clamps_turn else ("control", scene.drives.unit)


def control_text(scene: Scene | None, control: float, form: str = ".6g") -> str:
    """The control with its name and unit."""
    name, unit = name_and_unit(scene)
    return f"{name} {control:{form}} {unit}".rstrip()


def axis_of(scene: Scene | None) -> str:
    """The head of a column of controls."""
    name, unit = name_and_unit(scene)
    return f"{name} ({unit})" if unit else name


class Controlled(Value):
    """A result along a control; `angle` is that where it is one of clamps."""

    @property
    def angle(self) -> Any:
        """The control, where only clamps are turned.

        Raises
        ------
        SceneError
            Where something else moves.
        """
        scene = self.scene  # type: ignore[attr-defined]
        if scene is not None and not scene.clamps_turn:
            raise SceneError(f"angle: what moves is drive = {scene.drive!r}, no angle; read `control`")
        return self.control  # type: ignore[attr-defined]


@dataclass(frozen=True, repr=False, eq=False)
class Fold(Controlled):
    """A saddle-node bifurcation in the control.

    Attributes
    ----------
    control: where the scene's control is at the fold: an angle in rad, a length in L, a force in EI2/L^2.
    height: z(1/2)/L there.
    load: compressive end force times L^2/EI2 (sigma^2 of the quasi-linear beam).
    model, scene, options: what it is a fold of, by which model and on which mesh; of a bare Fold
        "", None and {}.
    slope: z-component of the unit tangent at midspan; NaN of a bare Fold.
    """

    control: float
    height: float
    load: float
    model: str = ""
    scene: Scene | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    slope: float = math.nan

    def __repr__(self) -> str:
        of = "; ".join(part for part in (self.model, short_options(self.options)) if part)
        return (
            f"Fold({control_text(self.scene, self.control, '.9g')}, z(1/2) {self.height:.9g} L, "
            f"load {self.load:.9g} EI2/L^2{f'; {of}' if of else ''})"
        )

    def _repr_html_(self) -> str:
        row = [float(self.control), float(self.height), float(self.load)]
        return html_table(caption(self), (axis_of(self.scene), "z(1/2)/L", "load (EI2/L^2)"), [row])


def caption(result: Any) -> str:
    """What a table shows: the result in short, and its scene."""
    scene = getattr(result, "scene", None)
    return repr(result) if scene is None else f"{result!r}\n{scene.in_words}"


def uniform(positions: Array | None) -> Array:
    """s/L of nodes at equal distances, where nobody says otherwise; of none where there are none."""
    return np.linspace(0.0, 1.0, positions.shape[1]) if positions is not None else np.zeros(0)


@dataclass(frozen=True, repr=False, eq=False)
class Instability(Controlled):
    """Where the state that a slow ramp follows is lost.

    Attributes
    ----------
    control: where the scene's control is there.
    kind: "fold"; "pitchfork", where the reduced equation has no quadratic term; "branch", where it has one.
    subcritical: whether the states that cross there are there before it: of a pitchfork the sign of the
        cubic term.
    out_of_plane: whether a planar state leaves its plane.
    height: z(1/2)/L there.
    load: compressive end force times L^2/EI2.
    model, scene, options: what it is an instability of, by which model and on which mesh.
    """

    control: float
    kind: str
    subcritical: bool
    out_of_plane: bool
    height: float
    load: float
    model: str = ""
    scene: Scene | None = None
    options: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        what = ("subcritical " if self.subcritical and self.kind == "pitchfork" else "") + self.kind
        return (
            f"Instability({what} at {control_text(self.scene, self.control, '.9g')}"
            f"{', out of the plane' if self.out_of_plane else ''}, z(1/2) {self.height:.9g} L)"
        )


@dataclass(frozen=True, repr=False, eq=False)
class Branch(Controlled):
    """A connected curve of equilibria, one row a point, in the order of the curve.

    Attributes
    ----------
    control: (rows,) of the scene.
    height: (rows,) z(1/2)/L.
    slope: (rows,) z-component of the unit tangent at midspan.
    load: (rows,) compressive end force times L^2/EI2.
    stable: (rows,) bool; a fold itself is never a row.
    folds: the folds met along the curve, in its order.
    configurations: (rows, nodes, 3) positions in L.
    scene, options, model: what it was made from.
    arclength: (nodes,) s/L of the nodes of the configurations.
    energy: (rows,) elastic, in EI2/L; NaN where the program that made the branch does not say.
    normals: of a ribbon in three dimensions the unit vectors m1 normal to its surface, at the nodes (rows,
        nodes, 3) or at the edges between them (rows, nodes - 1, 3); None of planar beams.
    """

    control: Array
    height: Array
    slope: Array
    load: Array
    stable: NDArray[np.bool_]
    folds: tuple[Fold, ...]
    configurations: Array
    scene: Scene
    options: Mapping[str, Any] = field(default_factory=dict)
    model: str = ""
    arclength: Array = None  # type: ignore[assignment]
    energy: Array = None  # type: ignore[assignment]
    normals: Array | None = None

    def __post_init__(self) -> None:
        if self.arclength is None:
            object.__setattr__(self, "arclength", uniform(self.configurations))
        if self.energy is None:
            object.__setattr__(self, "energy", np.full(len(self.control), np.nan))
        super().__post_init__()

    def __len__(self) -> int:
        return len(self.control)

    def __repr__(self) -> str:
        name, unit = name_and_unit(self.scene)
        span = f"{name} {self.control.min():.4g} .. {self.control.max():.4g} {unit}" if len(self) else "empty"
        folds = ", ".join(f"{fold.control:.6g}" for fold in self.folds) or "none"
        return (
            f"Branch({self.model or 'any model'}, {len(self)} points, {span}, "
            f"{int(np.count_nonzero(self.stable))} stable;\n"
            f"  folds at {folds} {unit};\n"
            f"  {short_options(self.options)})"
        )

    def plot(self, axes: Any = None, **options: Any) -> Any:
        """Draw it into axes of matplotlib, or new ones: see `ribbonfem.output.plots.branch`."""
        return called_later("ribbonfem.output.plots:branch", self, axes, **options)

    def to_pandas(self) -> Any:
        """As a `pandas.DataFrame`: see `ribbonfem.output.tables.branch_frame`."""
        return called_later("ribbonfem.output.tables:branch_frame", self)

    def to_xarray(self) -> Any:
        """As an `xarray.Dataset`: see `ribbonfem.output.tables.branch_dataset`."""
        return called_later("ribbonfem.output.tables:branch_dataset", self)

    def _repr_html_(self) -> str:
        columns = ("", axis_of(self.scene), "z(1/2)/L", "load (EI2/L^2)")
        rows: list[list[Any]] = [
            ["fold", float(fold.control), float(fold.height), float(fold.load)] for fold in self.folds[:8]
        ]
        rows += [
            ["stable" if self.stable[k] else "unstable"]
            + [float(c[k]) for c in (self.control, self.height, self.load)]
            for k in some_rows(len(self), 12 - len(rows))
        ]
        return html_table(caption(self), columns, rows)


@dataclass(frozen=True, repr=False, eq=False)
class RestState(Controlled):
    """One equilibrium of the ribbon.

    Attributes
    ----------
    name: of the state as its signs say, "U+S+" and so on.
    control: where the scene's control is.
    height, slope: z(1/2)/L and the z-component of the tangent there.
    force: (3,) n, the force in the rod at the right clamp, which pulls with it, in the fixed frame, EI2/L^2.
    energy: elastic, in EI2/L.
    index: number of unstable directions; 0 is stable.
    s: (nodes,) arclength of the nodes, in L.
    positions: (nodes, 3) in L.
    directors: (nodes, 3, 3), rows m1 (normal), m2 (width), m3 (tangent).
    points: (points,) arclength of the rows of kappa1, kappa2 and tau.
    kappa1, kappa2, tau: (points,) curvatures about m1 and m2, and twist, in 1/L.
    scene: what it is a state of.
    reactions: (2, 6) of the left and of the right clamp, as in `History`; NaN where the program that made the
        state does not say.
    """

    name: str
    control: float
    height: float
    slope: float
    force: Array
    energy: float
    index: int
    s: Array
    positions: Array
    directors: Array
    points: Array
    kappa1: Array
    kappa2: Array
    tau: Array
    scene: Scene
    reactions: Array = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        if self.reactions is None:
            object.__setattr__(self, "reactions", np.full((2, 6), np.nan))
        super().__post_init__()

    def plot(self, axes: Any = None, **options: Any) -> Any:
        """Draw it into axes of matplotlib, or new ones: see `ribbonfem.output.plots.rest`."""
        return called_later("ribbonfem.output.plots:rest", self, axes, **options)

    def _repr_html_(self) -> Any:
        return called_later("ribbonfem.output.plots:rest_table", self)

    def __repr__(self) -> str:
        return (
            f"RestState({self.name!r}, {control_text(self.scene, self.control)}, z(1/2) {self.height:.6g} L, "
            f"energy {self.energy:.6g} EI2/L, index {self.index})"
        )
