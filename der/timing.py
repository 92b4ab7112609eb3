"""Benchmarks of the rod's kernels, called one by one from compiled wrappers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ribbonfem.scene import Scene

from . import kernels
from .problem import Statics
from .rod import Rod
from .states import RodState, forget, start_state


def start(scene: Scene, nodes: int) -> Callable[[], Any]:
    """The static start of a scene, as a call to be timed: what is kept of earlier calls is forgotten."""
    rod = Rod(scene, nodes)

    def afresh() -> RodState:
        forget()
        return start_state(rod)

    return afresh


def parts(scene: Scene, nodes: int) -> dict[str, Callable[[], Any]]:
    """The kernels of a Newton iteration about a scene's start, as calls to be timed; each has been called."""
    rod = Rod(scene, nodes)
    state = start_state(rod)
    problem = Statics(rod)
    tangent, inverse = state.edges
    gradient, energies = np.zeros(4 * nodes), np.zeros(3)
    viscous = np.zeros((nodes, 4))
    hessian = np.zeros((4 * nodes + kernels.WIDTH, kernels.WIDTH + 1))
    first, last = rod.free.start, rod.free.stop
    m1, twist, turn = state.m1.copy(), state.twist.copy(), np.zeros(nodes)
    shifted = problem.assemble(state)[2]
    shifted[: 4 * nodes, 0] += 1e6 * rod.inertia
    factors, right = shifted.copy(), np.zeros(4 * nodes + kernels.WIDTH)

    def assemble(second: bool) -> None:
        material, sums = (rod.stiffness, rod.rest, rod.stretch, rod.shape), (gradient, hessian, energies)
        kernels.assemble(material, tangent, inverse, m1, twist, viscous, 1.0, *sums, second, nodes)

    def factor() -> None:
        factors[:] = shifted
        kernels.factor(factors, first, last)

    calls: dict[str, Callable[[], Any]] = {
        "edges": lambda: kernels.edges(state.x, tangent, inverse),
        "frames": lambda: kernels.carry(tangent, state.m1, state.twist, tangent, turn, m1, twist),
        "forces": lambda: assemble(False),
        "forces and Hessian": lambda: assemble(True),
        "copy": lambda: factors.__setitem__(slice(None), shifted),
        "copy and factorisation": factor,
        "solve": lambda: kernels.solve(factors, first, last, right),
    }
    for call in calls.values():
        call()
    return calls
