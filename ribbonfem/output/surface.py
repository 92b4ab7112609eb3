"""The ribbon as a surface of its true width along its centreline, frame by frame, for films and VTU."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline

from ribbonfem import Branch, History, Scene
from ribbonfem.results import Array, RestState

# points along a strip at the least
_POINTS = 161
# rows on each side of one that its velocity is read off
_BESIDE = 3


@dataclass(frozen=True)
class Strip:
    """A strip at several instants or angles.

    Attributes
    ----------
    s: (nodes,) arclength, from one clamp to the other, in [0, 1].
    time: (frames,) s; of a curve of equilibria the number of the row.
    angle: (frames,) of the clamp, rad; height, (frames,) z(1/2)/L; slope, (frames,) t_z(1/2).
    centre: (frames, nodes, 3) in L.
    width: (frames, nodes, 3) unit vectors m2 along the width.
    normal: (frames, nodes, 3) unit vectors m1.
    kappa1, kappa2, tau: (frames, nodes) curvatures about m1 and m2, and twist, in 1/L.
    scene: what it is of; its width over L is `half` times two.
    velocity: (frames, nodes, 3) L/s of the centreline; None of states at rest.
    """

    s: Array
    time: Array
    angle: Array
    height: Array
    slope: Array
    centre: Array
    width: Array
    normal: Array
    kappa1: Array
    kappa2: Array
    tau: Array
    scene: Scene
    velocity: Array | None = None

    @property
    def half(self) -> float:
        """Half the width in L."""
        return 0.5 * self.scene.ribbon.width / self.scene.ribbon.length

    @property
    def edges(self) -> Array:
        """(frames, 2, nodes, 3) the two long edges, in L."""
        across = self.half * self.width
        return np.stack((self.centre - across, self.centre + across), axis=1)


def state_name(height: float, slope: float) -> str:
    """The name of a shape by its signs, as `ribbonfem.outcomes` names it; level ones have no letter."""
    u = "" if abs(height) < 1e-6 else "U+" if height > 0.0 else "U-"
    if abs(slope) < 1e-6 or not u:
        return u
    return u + ("S-" if height * slope > 0.0 else "S+")


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((a * b).sum(axis=-1))


def _spline(s: Array, rows: Array) -> Any:
    """The smooth curve through rows (..., nodes, 3): elements have few nodes, rods end beyond the clamps."""
    return make_interp_spline(s, rows, k=min(5, len(s) - 1 - (len(s) % 2)), axis=1)


def _strip(
    s: Array,
    positions: Array,
    normals: Array | None,
    velocity: Array | None = None,
    curvature: Array | None = None,
    **columns: Any,
) -> Strip:
    """A strip of positions (rows, nodes, 3), and normals at the nodes or between them, None of planar beams.

    Curvatures and twist are the model's own where it hands them out (`curvature` of planar beams, of few
    nodes), else those of the curves through the nodes: their derivatives, and no differences of what is
    drawn, which at a clamp would be off by half.
    """
    grid = np.linspace(0.0, 1.0, max(_POINTS, len(s)))
    curve = _spline(s, positions)
    centre, along, turn = (np.asarray(curve(grid, order)) for order in range(3))
    stretch = np.linalg.norm(along, axis=-1)
    tangent = along / stretch[..., None]
    turn = (turn - _dot(turn, tangent)[..., None] * tangent) / stretch[..., None] ** 2
    if normals is None:
        # a planar beam bends about its width, which is y
        m2 = np.zeros_like(centre)
        m2[..., 1] = -1.0
        m1, tau = _unit(np.cross(m2, tangent)), np.zeros_like(stretch)
    else:
        at = s if normals.shape[1] == len(s) else 0.5 * (s[1:] + s[:-1])
        across = _spline(at, normals)
        m1, rolling = np.asarray(across(grid)), np.asarray(across(grid, 1))
        lean = _dot(m1, tangent)
        m1 = m1 - lean[..., None] * tangent
        length = np.linalg.norm(m1, axis=-1)
        m1 /= length[..., None]
        m2 = np.cross(tangent, m1)
        tau = (_dot(rolling, m2) / stretch - lean * _dot(turn, m2)) / length
    return Strip(
        s=grid,
        centre=centre,
        width=m2,
        normal=m1,
        kappa1=-_dot(turn, m2),
        kappa2=_dot(turn, m1) if curvature is None else np.asarray(_spline(s, curvature)(grid)),
        tau=tau,
        velocity=None if velocity is None else np.asarray(_spline(s, velocity)(grid)),
        **columns,
    )


def _rates(time: Array, values: Array, row: int, kinks: Sequence[int]) -> Array:
    """d(values)/d(time) at a row, of the polynomial through the rows around it; none beyond a kink."""
    low = max((k for k in kinks if k < row), default=0)
    high = min((k for k in kinks if k >= row), default=len(time) - 1)
    if row == low:
        high = min((k for k in kinks if k > row), default=len(time) - 1)
    first = max(min(row - _BESIDE, high - 2 * _BESIDE), low)
    rows = slice(first, min(first + 2 * _BESIDE, high) + 1)
    x = time[rows] - time[row]
    reach = float(np.abs(x).max())
    if reach == 0.0:
        return np.zeros_like(values[row])
    weights = np.linalg.solve(np.vander(x / reach, increasing=True).T, np.eye(len(x))[1]) / reach
    return np.asarray(np.tensordot(weights, values[rows], axes=1))


def of_motion(history: History, frames: int = 150, until: float | None = None) -> Strip:
    """A motion at equal distances of time: adaptive steps would make a film run unevenly.

    Parameters
    ----------
    history: with configurations.
    frames: how many.
    until: s, the last instant; by default the end.

    Raises
    ------
    ValueError
        If the history has no configurations.
    """
    if "positions" not in history.configurations or not len(history):
        raise ValueError("a motion without configurations has no shape: simulate with configurations=True")
    end = float(history.time[-1]) if until is None else min(until, float(history.time[-1]))
    time = np.linspace(float(history.time[0]), end, frames)
    k = np.clip(np.searchsorted(history.time, time, side="right") - 1, 0, max(len(history) - 2, 0))
    after = np.minimum(k + 1, len(history) - 1)
    span = np.maximum(history.time[after] - history.time[k], 1e-300)
    share = np.clip((time - history.time[k]) / span, 0.0, 1.0)

    def at(rows: Array) -> Array:
        weight = share.reshape(-1, *(1,) * (rows.ndim - 1))
        return np.asarray(rows[k] * (1.0 - weight) + rows[after] * weight)

    positions = history.configurations["positions"]
    normals, curvature = map(history.configurations.get, ("normals", "curvature"))
    velocities = history.configurations.get("velocities")
    if velocities is None:
        # of methods whose velocities ring, and of files of a version that did not keep them
        kinks = history.kinks(history.time, history.control)
        velocities = np.zeros_like(positions)
        for row in {*k, *after}:
            velocities[row] = _rates(history.time, positions, row, kinks)
    return _strip(
        history.arclength,
        at(positions),
        None if normals is None else at(normals),
        at(velocities),
        None if curvature is None else at(curvature),
        time=time,
        angle=at(history.control),
        height=at(history.height),
        slope=at(history.slope),
        scene=history.scene,
    )


def area(strip: Strip) -> Array:
    """(frames,) area of the surface in L^2, of quads between the edges seen along their normals.

    That is W L. Cross-sections of a rod stay straight, so twist lengthens its edges, and the surface
    that they sweep is larger, by (W tau)^2 / 24 of it.
    """
    low, high = strip.edges[:, 0], strip.edges[:, 1]
    one = np.cross(low[:, 1:] - high[:, :-1], high[:, 1:] - low[:, :-1])
    return np.asarray(0.5 * np.linalg.norm(one, axis=-1).sum(axis=1))


def of_branch(branch: Branch, frames: int = 150) -> Strip:
    """The states of a curve of equilibria, at rows equally far apart in its length.

    Raises
    ------
    ValueError
        For a curve of a sheared ribbon without normals, as other programs make it.
    """
    if not branch.scene.planar and branch.normals is None:
        raise ValueError(
            "a curve of a sheared ribbon without normals has no surface: show a motion, or `state`"
        )
    rows = np.unique(np.linspace(0, len(branch) - 1, frames).round().astype(int))
    return _strip(
        branch.arclength,
        np.asarray(branch.configurations)[rows],
        None if branch.normals is None else np.asarray(branch.normals)[rows],
        time=rows.astype(float),
        angle=branch.control[rows],
        height=branch.height[rows],
        slope=branch.slope[rows],
        scene=branch.scene,
    )


def of_result(result: History | Branch, frames: int, until: float | None = None) -> Strip:
    """A motion, or the states of a curve of equilibria (then `until` does not count)."""
    return of_branch(result, frames) if isinstance(result, Branch) else of_motion(result, frames, until)


def of_rest(state: RestState) -> Strip:
    """A state at rest, as a strip of one instant."""
    return _strip(
        state.s,
        state.positions[None],
        state.directors[None, :, 0],
        time=np.zeros(1),
        angle=np.array([state.control]),
        height=np.array([state.height]),
        slope=np.array([state.slope]),
        scene=state.scene,
    )
