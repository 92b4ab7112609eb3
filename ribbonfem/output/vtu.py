"""Frames of a motion exported for ParaView: one VTU file an instant, and a PVD that lists them in time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ribbonfem import Branch, History
from ribbonfem.output.files import whole, write_whole
from ribbonfem.results import Array

from .surface import Strip, of_result

# quads across the width
_ACROSS = 4
# a narrower strip is lengthened less: each round leaves a fifth of what is amiss
_ROUNDS = 3


def _areas(points: Array) -> Array:
    """(nodes - 1,) area between cross-sections (nodes, places, 3), of two triangles a quad."""
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    twice = np.linalg.norm(np.cross(b - a, c - a), axis=-1) + np.linalg.norm(np.cross(c - a, d - a), axis=-1)
    return np.asarray(0.5 * twice.sum(axis=1))


def _surface(strip: Strip, frame: int) -> tuple[Array, Array]:
    """Points (nodes * (_ACROSS + 1), 3) and quads of an instant, of the area of the flat ribbon.

    A thin sheet keeps its area. Cross-sections of a rod stay straight, so that twist lengthens what lies off
    the centreline, and sweeps (W tau)^2 / 24 too much: up to 2 % of W L in a snap. Quads between points of a
    curved surface leave out a part in a thousand. The width is what makes up for both.
    """
    places = np.linspace(-strip.half, strip.half, _ACROSS + 1)
    across = places[None, :, None] * strip.width[frame, :, None]
    centre = strip.centre[frame, :, None]
    flat = 2.0 * strip.half * np.diff(strip.s)
    points = centre + across
    narrowed = np.ones(len(strip.s))
    for _ in range(_ROUNDS):
        share = flat / _areas(points)
        narrowed *= np.concatenate((share[:1], 0.5 * (share[1:] + share[:-1]), share[-1:]))
        points = centre + narrowed[:, None, None] * across
    nodes, count = len(strip.s), _ACROSS + 1
    first = (np.arange(nodes - 1)[:, None] * count + np.arange(_ACROSS)[None, :]).ravel()
    return points.reshape(-1, 3), np.column_stack((first, first + 1, first + count + 1, first + count))


def fields(strip: Strip, frame: int) -> dict[str, Array]:
    """Fields (nodes,) or (nodes, 3) of an instant: curvatures, twist, velocity, energy density.

    kappa1, kappa2 and tau in 1/L; velocity in L/s, of a motion: its own, of methods that let velocities ring
    the derivative of the polynomial through seven rows; the density of bending and twist in EI2/L^2.
    """
    kappa1, kappa2, tau = strip.kappa1[frame], strip.kappa2[frame], strip.tau[frame]
    ratio, twist = strip.scene.ribbon.bending_ratio, strip.scene.ribbon.twist_ratio
    moving = {} if strip.velocity is None else {"velocity": strip.velocity[frame]}
    return {
        "s": strip.s,
        "kappa1": kappa1,
        "kappa2": kappa2,
        "tau": tau,
        **moving,
        "energy_density": 0.5 * (ratio * kappa1**2 + kappa2**2 + twist * tau**2),
        "normal": strip.normal[frame],
    }


def frames(
    history: History | Branch,
    folder: str | Path,
    *,
    count: int = 150,
    until: float | None = None,
    progress: Callable[[range], Any] = iter,
) -> Path:
    """Write a motion, or a curve of equilibria, as VTU files with a PVD beside them; returns its path.

    The surface has the area W L at every instant; for it the width is up to 2 % less where twist is strong.

    Parameters
    ----------
    history: with configurations, or a curve of equilibria: then a row's number stands for the time.
    folder: of the files; made if it is not there.
    count: of frames, at equal distances of time; until, the last instant in s.
    progress: is given the numbers of the frames, and yields them.

    Raises
    ------
    ValueError
        For a motion without configurations.
    OSError
        If the files cannot be written.
    """
    import meshio

    where = Path(folder)
    where.mkdir(parents=True, exist_ok=True)
    strip = of_result(history, count, until)
    entries = []
    for frame in progress(range(len(strip.time))):
        points, quads = _surface(strip, frame)
        data = {name: np.repeat(values, _ACROSS + 1, axis=0) for name, values in fields(strip, frame).items()}
        file = f"frame-{frame:05d}.vtu"
        with whole(where / file, ".vtu") as aside:
            meshio.Mesh(points, [("quad", quads)], point_data=data).write(aside)
        time = float(strip.time[frame])
        entries.append(f'    <DataSet timestep="{time!r}" group="" part="0" file="{file}"/>')
    lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">', "  <Collection>"]
    write_whole(where / "motion.pvd", "\n".join([*lines, *entries, "  </Collection>", "</VTKFile>", ""]))
    return where / "motion.pvd"
