"""Arrays of the compiled time loop of the Kirchhoff rod: columns of a row, state, scratch memory."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ribbonfem.ends.kernels import POSE_SIZE
from ribbonfem.jit.references import by_reference
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.arrays import ROW_SIZE as COLUMNS
from ribbonfem.stepping.kernels.guess import GUESS, MEMORY

from .batch import WIDTH, groups_of
from .rod import P, Rod, Solver

# a column of rows behind those of the time loop
SLOPE = COLUMNS
ROW_SIZE = COLUMNS + 1


@by_reference
class Motion(NamedTuple):
    """State at the last accepted instant.

    x, v, a, auxiliary (nodes, 4); g (nodes, 4); n (G, P, 3, WIDTH); tangent and its rate (nodes, 3); strain
    and its rate (G, P, 4, WIDTH), of a rod that retards (`law`).
    """

    x: Array
    v: Array
    a: Array
    auxiliary: Array
    g: Array
    n: Array
    tangent: Array
    tangent_rate: Array
    strain: Array
    strain_rate: Array
    clock: Array


@by_reference
class Scratch(NamedTuple):
    """What a step overwrites, and the stages remembered for guesses; pose, see `ends.kernels`.

    stage (4,): b, f and ft of x = xp + b a, v = vp + f a, and tangents tp + ft (their rate); damping.
    """

    xp: Array
    vp: Array
    tp: Array
    x: Array
    v: Array
    a: Array
    g: Array
    n: Array
    force: Array
    tangent: Array
    tangent_rate: Array
    stage_v: Array
    stage_a: Array
    stage_tangent_rate: Array
    known_time: Array
    known_g: Array
    known_n: Array
    known_a: Array
    lagrange: Array
    spin: Array
    known_spin: Array
    strain: Array
    strain_rate: Array
    known_strain: Array
    stage_strain_rate: Array
    pose: Array
    stage: Array
    out: Array


@by_reference
class Moving(NamedTuple):
    """A rod in motion; `row_x`, `row_m1`, `row_v` (rows, nodes, 3) take configurations of rows, if any."""

    rod: Rod
    solver: Solver
    scratch: Scratch
    motion: Motion
    row_x: Array
    row_m1: Array
    row_v: Array


def strains(elements: int, retards: bool) -> Array:
    """Strains and stretch at the Gauss points of a rod that retards, none of another."""
    return np.zeros((groups_of(elements) if retards else 0, P, 4, WIDTH))


def scratch(elements: int, stages: int, retards: bool = False) -> Scratch:
    """Memory for a mesh and a method, and the strains of a rod that retards."""
    nodes = elements * P + 1

    def zeros() -> Array:
        return np.zeros((nodes, 4))

    return Scratch(
        xp=zeros(),
        vp=zeros(),
        tp=np.zeros((nodes, 3)),
        x=zeros(),
        v=zeros(),
        a=zeros(),
        g=zeros(),
        n=np.zeros((groups_of(elements), P, 3, WIDTH)),
        force=zeros(),
        tangent=np.zeros((nodes, 3)),
        tangent_rate=np.zeros((nodes, 3)),
        stage_v=np.zeros((stages, nodes, 4)),
        stage_a=np.zeros((stages, nodes, 4)),
        stage_tangent_rate=np.zeros((stages, nodes, 3)),
        known_time=np.zeros(MEMORY),
        known_g=np.zeros((MEMORY, nodes, 4)),
        known_n=np.zeros((MEMORY, groups_of(elements), P, 3, WIDTH)),
        known_a=np.zeros((MEMORY, nodes, 4)),
        lagrange=np.zeros(GUESS),
        spin=np.zeros((nodes, 3)),
        known_spin=np.zeros((nodes, 3)),
        strain=strains(elements, retards),
        strain_rate=strains(elements, retards),
        known_strain=strains(elements, retards),
        stage_strain_rate=np.zeros((stages, *strains(elements, retards).shape)),
        pose=np.zeros(POSE_SIZE),
        stage=np.zeros(4),
        out=np.zeros(4),
    )
