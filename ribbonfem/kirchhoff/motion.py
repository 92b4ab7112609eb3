"""The ribbon in motion by finite elements: a geometrically exact rod without shear.

With lengths in L, forces in EI2/L^2, time in t*, c = EI2 / (EA L^2) or 0, the rod moves by

    int [ 1/2 (EI1 kappa1^2 + EI2 kappa2^2 + GJ tau^2) + n.(r' - t) - c (n.t)^2 / 2 ] ds

and the inertia of r and of the rotation about the tangent (`Ribbon.rotary_inertia`): what the
discrete rods tend to.  Bending rotations and n carry no mass and follow at the same instant.
Damping is -nu M v on both.
"""

from __future__ import annotations

import time as clock_time
from typing import Any

import numpy as np

from . import tangent as kernels
from . import loop
from ribbonfem.stepping import newmark, tableaus
from .problem import Frames, Statics
from ribbonfem.elements.lobatto import lobatto_points
from ribbonfem.stepping.newmark import ENERGIES, LARGEST_TURN, NEWTON_TOLERANCE, PROBLEMS, SMALLEST_STEP, Control
from ribbonfem.results import Array, History, SolverError
from ribbonfem.scene import Scene

TABLEAUS = {"tr-bdf2": tableaus.tr_bdf2, "implicit-euler": tableaus.implicit_euler}
# rows are made in chunks of this many bytes of configurations
_CHUNK = 8_000_000
_warm: set[tuple[Any, ...]] = set()


def lumps(elements: int) -> Array:
    """(elements, P + 1) masses of the nodes of each element, by Gauss-Lobatto quadrature; in sum 1."""
    points = lobatto_points(kernels.P)
    powers = np.arange(kernels.P + 1)
    weights = np.linalg.solve(points[None, :] ** powers[:, None], 1.0 / (powers + 1.0))
    return np.tile(weights / elements, (elements, 1))


def discretised(problem: Statics, scene: Scene) -> kernels.Rod:
    """The rod as arrays for the compiled time loop."""
    tables, elements, p = problem.tables, problem.tables.elements, kernels.P
    mass = lumps(elements)
    nodes = len(tables.nodes)
    inertia = np.zeros((nodes, 4))
    for i in range(p + 1):
        inertia[i : i + elements * p : p, :3] += mass[:, i, None]
    inertia[:, 3] = scene.ribbon.rotary_inertia * inertia[:, 0]
    coupling = tables.weights[:, :, None] * tables.slope
    inside = coupling[:, :, 1:p]
    share = np.einsum("eki,eli,ei->ekl", inside, inside, 1.0 / mass[:, 1:p])
    return kernels.Rod(
        value=tables.value,
        slope=tables.slope,
        weights=tables.weights,
        coupling=np.ascontiguousarray(coupling),
        share=np.ascontiguousarray(share),
        mass=mass,
        inertia=inertia,
        stiff=problem.stiff,
        soft=problem.soft,
        spin=scene.ribbon.rotary_inertia,
        middle=nodes // 2,
    )


def at_rest(problem: Statics, state: Frames) -> loop.Motion:
    """The state of the time loop in an equilibrium at alpha = 0."""
    nodes, elements = len(state.g), problem.tables.elements
    x = np.zeros((nodes, 4))
    x[:, :3] = problem.positions(state, 0.0)
    # the right clamp, to the last digit
    x[-1, :3] = problem.at(0.0).chord()
    clock = np.zeros(loop.CLOCK_SIZE)
    clock[loop.KINK] = 1.0
    return loop.Motion(
        x=x,
        v=np.zeros_like(x),
        a=np.zeros_like(x),
        auxiliary=np.zeros_like(x),
        g=state.g.copy(),
        n=np.tile(state.force, (elements, kernels.P, 1)),
        tangent=np.zeros((nodes, 3)),
        turning=np.zeros((nodes, 3)),
        clock=clock,
    )


def scheme_of(method: newmark.Method) -> loop.Scheme:
    """A method's coefficients for the compiled time loop."""
    tableau = TABLEAUS.get(method.name)
    if tableau is not None:
        data = tableau()
        return loop.Scheme(
            loop.DIRK, data.stages, data.a, data.c, data.error, data.embedded + 1.0, *(8 * (0.0,)), False
        )
    return loop.Scheme(
        loop.ONE_STAGE,
        2,
        np.zeros((2, 2)),
        np.array([0.0, 1.0]),
        np.zeros(2),
        method.order + 1.0,
        *method.positions,
        *method.velocities,
        method.alpha_m,
        method.alpha_f,
        *method.error,
        method.project,
    )


def ramp_of(
    scene: Scene, control: Control, *, every: int = 1, gyroscopic: bool = False, barrier: float = -np.inf
) -> loop.Ramp:
    """The clamp's motion and the control of steps."""
    unit = scene.ribbon.inertial_time
    rate, stop = scene.rate * unit, scene.require_stop()
    turned = stop / rate
    if control.step is None:
        newton = max(1e-11, NEWTON * (control.tolerance or 0.0))
    else:
        newton = NEWTON_TOLERANCE
    return loop.Ramp(
        rate=rate,
        stop=stop,
        turned=turned,
        end=turned + scene.hold / unit,
        damping=scene.damping * unit,
        fixed=0.0 if control.step is None else control.step / unit,
        tolerance=control.tolerance or 0.0,
        largest=min(LARGEST_TURN / abs(rate), 0.1 * turned),
        newton=newton,
        smallest=SMALLEST_STEP,
        snap=control.until == "snap",
        barrier=barrier,
        gyroscopic=gyroscopic,
        every=every,
    )


# part of the tolerance that Newton may leave in a position
NEWTON = 3e-3


class Run:
    """A motion between its calls of the compiled loop: buffers, and the rows written so far."""

    def __init__(self, rod: kernels.Rod, scheme: loop.Scheme, motion: loop.Motion, configurations: bool):
        elements = len(rod.weights)
        self.rod, self.scheme, self.motion, self.kept = rod, scheme, motion, configurations
        self.solver = kernels.solver(elements)
        self.scratch = loop.scratch(elements, scheme.stages)
        self.capacity = max(256, _CHUNK // (48 * len(motion.x)))
        self.chunks: list[tuple[Array, Array, Array]] = []

    def go(self, ramp: loop.Ramp) -> int:
        """Run to the end or until it fails; returns the status of the compiled loop."""
        nodes = len(self.motion.x)
        status = loop.FULL
        while status == loop.FULL:
            room = self.capacity if self.kept else 0
            rows = np.empty((self.capacity, loop.ROW_SIZE))
            x, m1 = np.empty((room, nodes, 3)), np.empty((room, nodes, 3))
            self.motion.clock[loop.ROWS] = 0.0
            status = loop.run(
                self.rod, self.scheme, ramp, self.solver, self.scratch, self.motion, rows, x, m1
            )
            count = int(self.motion.clock[loop.ROWS])
            self.chunks.append((rows[:count], x[:count], m1[:count]))
        return int(status)

    def history(self, scene: Scene, policy: dict[str, Any], seconds: float) -> History:
        """The rows so far."""
        rows, x, m1 = (np.concatenate(parts) for parts in zip(*self.chunks, strict=True))
        clock = self.motion.clock
        columns = rows.T.copy()
        kept = {"positions": x, "normals": m1} if self.kept else {}
        return History(
            time=columns[0] * scene.ribbon.inertial_time,
            angle=columns[1],
            height=columns[2],
            slope=columns[3],
            energies=dict(zip(ENERGIES, columns[4:8], strict=True)),
            configurations={**kept, "load": columns[8]},
            stats={
                "steps": int(clock[loop.STEPS]),
                "newton_iterations": int(clock[loop.NEWTON]),
                "assemblies": int(clock[loop.ASSEMBLIES]),
                "rejected": int(clock[loop.REJECTED]),
                "seconds": seconds,
            },
            scene=scene,
            policy=policy,
        )


def integrate(
    problem: Statics, start: Frames, scene: Scene, control: Control, ramp: loop.Ramp, policy: dict[str, Any], configurations: bool
) -> History:
    """Step a rod from rest in an equilibrium through the scene's ramp and hold.

    Raises
    ------
    SolverError
        If the end was not reached; its `history` is what was.
    """
    rod = discretised(problem, scene)
    scheme = scheme_of(control.method)
    key = (loop.DIRK,)
    if key not in _warm:
        # compiled (or loaded) before the clock starts: one step of a short ramp
        _warm.add(key)
        Run(rod, scheme, at_rest(problem, start), False).go(
            ramp._replace(turned=1e-6, end=1e-6, stop=1e-6 * ramp.rate, fixed=1e-6)
        )
    run = Run(rod, scheme, at_rest(problem, start), configurations)
    began = clock_time.perf_counter()
    status = run.go(ramp)
    history = run.history(scene, policy, clock_time.perf_counter() - began)
    problem_text = PROBLEMS[status]
    if problem_text:
        where = f"t = {history.time[-1]:.6g} s, alpha = {history.angle[-1]:.6g} rad"
        raise SolverError(f"stopped at {where}: {problem_text}", history)
    return history
