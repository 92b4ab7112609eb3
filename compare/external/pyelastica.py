"""PyElastica on the moving ribbon: its Cosserat rod with position Verlet, clamped as `der` clamps.

The rod is discretised as the discrete elastic rod is, positions at nodes and directors on the
edges between them, so that the centred clamp of `der.rod` and its start state carry over.  It is
shearable, and its shear stiffness stays as the library sets it, 27/28 G A with G = E/3.  That
stiffness and the rotary inertia of the cross-section limit the explicit step, not the mesh.
"""

from __future__ import annotations

import time
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np
from numba import njit

import der
from ribbonfem import History, Scene, SolverError
from ribbonfem.results import Array

# rows a run records, one in so many seconds
SAMPLE = 1e-3


def missing() -> str:
    """What keeps PyElastica from running here; "" if nothing does."""
    return (
        "" if find_spec("elastica") else "PyElastica is not installed: the extra ribbonfem[peers] brings it"
    )


def start(scene: Scene, nodes: int) -> tuple[Array, Array]:
    """Positions (N, 3) and rows m1, m2, m3 of the edges (N - 1, 3, 3) of the start state of `der`, in L."""
    first = replace(scene, stop=1e-9 * np.sign(scene.rate), hold=0.0)
    rows = der.simulate(first, nodes=nodes, method="implicit-euler", step=1.0).configurations
    x, normal = rows["positions"][0], rows["normals"][0]
    tangent = np.diff(x, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    return x, np.stack((normal, np.cross(tangent, normal), tangent), axis=1)


@njit(cache=True)
def _turn(
    position: Array, frames: Array, right: Array, frame: Array, half: float, rate: float, time: float
) -> None:
    """The left edge centred on the origin and turned by the ramp, the right one in its place."""
    cos, sin = np.cos(rate * time), np.sin(rate * time)
    for node, sign in ((0, -1.0), (1, 1.0)):
        position[0, node], position[1, node], position[2, node] = sign * half * cos, 0.0, -sign * half * sin
    frames[0, 0, 0], frames[0, 1, 0], frames[0, 2, 0] = sin, 0.0, cos
    frames[1, 0, 0], frames[1, 1, 0], frames[1, 2, 0] = 0.0, -1.0, 0.0
    frames[2, 0, 0], frames[2, 1, 0], frames[2, 2, 0] = cos, 0.0, -sin
    position[:, -2:] = right
    frames[:, :, -1] = frame


@njit(cache=True)
def _spin(velocity: Array, spin: Array, half: float, rate: float, time: float) -> None:
    """The velocities that go with `_turn`."""
    cos, sin = np.cos(rate * time), np.sin(rate * time)
    for node, sign in ((0, -1.0), (1, 1.0)):
        velocity[0, node] = -sign * half * rate * sin
        velocity[1, node] = 0.0
        velocity[2, node] = -sign * half * rate * cos
    # m2 = -e_y, and the clamp turns about +e_y
    spin[0, 0], spin[1, 0], spin[2, 0] = 0.0, -rate, 0.0
    velocity[:, -2:] = 0.0
    spin[:, -1] = 0.0


def _rod(library: Any, scene: Scene, x: Array, directors: Array) -> Any:
    ribbon = scene.ribbon
    edges = len(x) - 1
    edge = 1.0 / (edges - 1) * ribbon.length
    area = ribbon.width * ribbon.thickness
    # second moments of area about the normal, I1, and about the width, I2
    i2 = ribbon.width * ribbon.thickness**3 / 12.0
    i1 = ribbon.width**3 * ribbon.thickness / 12.0
    rod = library.CosseratRod.straight_rod(
        edges,
        np.zeros(3),
        np.array([1.0, 0.0, 0.0]),
        np.array([0.0, 0.0, 1.0]),
        edges * edge,
        # of a circle with the same area: what the library takes the shear stiffness from
        np.sqrt(area / np.pi),
        ribbon.density,
        youngs_modulus=ribbon.young,
    )
    bending = ribbon.young * i2
    for k, ratio in enumerate((ribbon.bending_ratio, 1.0, ribbon.twist_ratio)):
        rod.bend_matrix[k, k] = ratio * bending
    # rotary inertia about the tangent as in `der`, which has no other; an explicit step needs all three,
    # or the stiff bending of the ribbon in its own plane would ask for steps ten times shorter
    for k, inertia in enumerate((i1, i2, i2 + i1)):
        rod.mass_second_moment_of_inertia[k, k] = ribbon.density * inertia * edge
        rod.inv_mass_second_moment_of_inertia[k, k] = 1.0 / (ribbon.density * inertia * edge)
    rod.position_collection[:] = x.T * ribbon.length
    rod.director_collection[:] = np.moveaxis(directors, 0, 2)
    return rod


def simulate(scene: Scene, *, nodes: int = 51, step: float = 2.5e-5) -> History:
    """The motion from rest in the start state through the ramp, as the functions `simulate` of the models.

    Raises
    ------
    SolverError
        If PyElastica is not installed, or where positions are not finite any more.
    """
    lacking = missing()
    if lacking:
        raise SolverError(lacking)
    # its import takes long, and the rest has to work without it
    library: Any = import_module("elastica")
    x, directors = start(scene, nodes)
    length, stop = scene.ribbon.length, scene.require_stop()
    half = 0.5 * float(np.linalg.norm(x[1] - x[0])) * length
    rate = scene.rate

    class Clamps(library.ConstraintBase):
        """The left end turns with the ramp, the right one stays."""

        def __init__(self, _position: Any, _director: Any, **given: Any) -> None:
            # the library hands over the constrained places, which are kept below
            super().__init__(**given)
            self.right = self._system.position_collection[:, -2:].copy()
            self.frame = self._system.director_collection[..., -1].copy()

        def constrain_values(self, system: Any, time: Any) -> None:
            position, frames = system.position_collection, system.director_collection
            _turn(position, frames, self.right, self.frame, half, rate, time)

        def constrain_rates(self, system: Any, time: Any) -> None:
            _spin(system.velocity_collection, system.omega_collection, half, rate, time)

    class System(library.BaseSystemCollection, library.Constraints, library.Damping):
        pass

    def make() -> tuple[Any, Any]:
        system = System()
        rod = _rod(library, scene, x, directors)
        system.append(rod)
        ends = {"constrained_position_idx": (0,), "constrained_director_idx": (0,)}
        system.constrain(rod).using(Clamps, **ends)
        damper = library.AnalyticalLinearDamper
        system.dampen(rod).using(damper, uniform_damping_constant=scene.damping, time_step=step)
        system.finalize()
        return system, rod

    stepper = library.PositionVerlet()
    system, rod = make()
    clock = np.float64(0.0)
    for _ in range(3):
        clock = stepper.step(system, clock, np.float64(step))
    system, rod = make()
    steps = round(stop / rate / step)
    every = max(1, round(SAMPLE / step))
    middle = nodes // 2
    times, heights = [0.0], [float(rod.position_collection[2, middle]) / length]
    size, clock = np.float64(step), np.float64(0.0)
    begin = time.process_time()
    for done in range(every, steps + 1, every):
        for _ in range(every):
            clock = stepper.step(system, clock, size)
        times.append(done * step)
        heights.append(float(rod.position_collection[2, middle]) / length)
        if not abs(heights[-1]) < 1.0:
            # the library itself would go on with numbers that are not finite
            raise SolverError(
                f"PyElastica at a step of {step:g} s: no message, but at t = {times[-1]:.3g} s "
                f"z(1/2) is {heights[-1]:.3g} L"
            )
    seconds = time.process_time() - begin
    height = np.array(heights)
    moments = np.array(times)
    return History(
        time=moments,
        control=rate * moments,
        height=height,
        slope=np.full(len(height), np.nan),
        energies={},
        configurations={},
        stats={"steps": steps, "seconds": seconds},
        scene=scene,
        options={"nodes": nodes, "step": step},
    )
