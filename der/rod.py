"""The discretised rod of a scene: nodes and edges, how clamps hold them, stiffnesses, masses.

Two clamps.  ``two-node`` is the paper's: the first two and last two nodes are fixed, at s = 0,
l and L - l, L with l = L/(N - 1).  It makes the ribbon stiffer by half an edge at each end, an
error O(1/N) in every fold.  ``centred`` (the default) centres the first and the last edge on
s = 0 and s = L, with l = L/(N - 2): the same number of unknowns and an error O(1/N^2).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ribbonfem.options import choice, require_memory, whole_number
from ribbonfem.results import Array
from ribbonfem.scene import Ribbon, Scene

from . import kernels

CLAMPS = ("centred", "two-node")


@dataclass(frozen=True)
class RodState:
    """Positions (N, 3) in L, director m1 (N - 1, 3) of each edge, twist angle (N,) at each node.

    `at` is the parameter at which they are: loads are those of it.  `lag` (N - 1,) is by how much the edges'
    strains fall short of those that the step to it was to make; None where there was no step.
    """

    x: Array
    m1: Array
    twist: Array
    at: float = 0.0
    lag: Array | None = None

    @cached_property
    def edges(self) -> tuple[Array, Array]:
        """Unit tangents (N - 1, 3) and inverse lengths (N - 1,) of the edges."""
        tangent, inverse = np.empty((len(self.x) - 1, 3)), np.empty(len(self.x) - 1)
        kernels.edges(self.x, tangent, inverse)
        return tangent, inverse

    def copy(self) -> RodState:
        """Return a state with arrays of its own."""
        return RodState(self.x.copy(), self.m1.copy(), self.twist.copy(), self.at)


class Rod:
    """The discretisation of a scene, in units of L and EI2/L.

    Parameters
    ----------
    scene: planar or sheared.
    nodes: N, at least 7.
    clamp: "centred" or "two-node".

    Attributes
    ----------
    rest: rest length l of an edge.
    stiffness: (3,) EI1, EI2, GJ over EI2.
    stretch: (N - 1,) EA times the length that an edge stands for; 0 for the clamped ones.
    inertia: (4 N,) mass of each unknown: l for positions, rotary inertia times l for angles; the
        whole ribbon weighs 1.
    arclength: (N,) s/L of the nodes.
    shape: (N, 2) natural curvature and twist of what each inner node stands for, rad.
    lumps: (N,) of the weight: the ribbon's mass between the clamps, at the nodes nearest to it.
    retardation: in t*.
    """

    def __init__(self, scene: Scene, nodes: int, clamp: str = "centred") -> None:
        self.scene = scene
        self.nodes = whole_number("nodes", nodes, 7)
        # vectors, two bands of the Hessian and a handful of rows
        require_memory("nodes", nodes, 4e3 * self.nodes, "the rod")
        scene.require_buckled()
        self.clamp = choice("clamp", clamp, CLAMPS)
        ribbon = scene.ribbon
        spans = self.nodes - 2 if clamp == "centred" else self.nodes - 1
        self.rest = 1.0 / spans
        first = -0.5 * self.rest if clamp == "centred" else 0.0
        self.arclength = first + self.rest * np.arange(self.nodes)
        self.stiffness = np.array([ribbon.bending_ratio, 1.0, ribbon.twist_ratio])
        self.stretch = np.full(self.nodes - 1, ribbon.stretch_ratio * self.rest)
        self.stretch[[0, -1]] = 0.0
        if clamp == "centred":
            # Half of a clamped edge belongs to the ribbon and would stretch with it; its
            # neighbour stands in for it, else the stretch alone would converge as 1/N.
            self.stretch[[1, -2]] /= 1.5
        inertia = np.full((self.nodes, 4), self.rest)
        inertia[:, 3] *= ribbon.rotary_inertia
        self.inertia: Array = inertia.ravel()
        self.retardation = ribbon.retardation / ribbon.inertial_time
        inner = np.asarray(self.arclength[1:-1], dtype=np.float64)
        self.shape: Array = np.zeros((self.nodes, 2))
        if ribbon.shaped:
            self.shape[1:-1] = _integrals(scene.ribbon, inner - 0.5 * self.rest, inner + 0.5 * self.rest)
        self.lumps: Array = np.full(self.nodes, self.rest)
        self.lumps[[0, -1]] = 0.0 if clamp == "centred" else 0.5 * self.rest

    @property
    def free(self) -> slice:
        """The free unknowns of the 4 N: theta^1 to theta^(N-3)."""
        return slice(7, 4 * self.nodes - 8)

    def middle(self, x: Array) -> tuple[Array, Array]:
        """Position (..., 3) and unit tangent (..., 3) at midspan of configurations (..., N, 3)."""
        half = (self.nodes - 1) // 2
        if self.nodes % 2:
            position = x[..., half, :]
            before = x[..., half, :] - x[..., half - 1, :]
            after = x[..., half + 1, :] - x[..., half, :]
            tangent = before / np.linalg.norm(before, axis=-1, keepdims=True)
            tangent = tangent + after / np.linalg.norm(after, axis=-1, keepdims=True)
        else:
            # cubic through the four nodes around the middle of the middle edge
            near, far = x[..., half : half + 2, :], x[..., half - 1 : half + 3 : 3, :]
            position = 0.5625 * near.sum(axis=-2) - 0.0625 * far.sum(axis=-2)
            tangent = x[..., half + 1, :] - x[..., half, :]
        return position, tangent / np.linalg.norm(tangent, axis=-1, keepdims=True)


def _integrals(ribbon: Ribbon, low: Array, high: Array) -> Array:
    """Integrals (n, 2) of the natural curvature and twist from s = low to high (n,)."""
    counts = [np.size(values) for values in (ribbon.curvature, ribbon.twist)]
    points = np.unique(np.concatenate((low, high, *(np.linspace(0.0, 1.0, max(n, 2)) for n in counts))))
    values = np.stack(ribbon.natural(points), axis=-1)
    steps = 0.5 * np.diff(points)[:, None] * (values[1:] + values[:-1])
    total = np.concatenate((np.zeros((1, 2)), np.cumsum(steps, axis=0)))
    return np.asarray(total[np.searchsorted(points, high)] - total[np.searchsorted(points, low)])
