"""Tuples of arrays that the compiled time loop of the elastica works on: state, memory of a step, beam."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ribbonfem.ends.planar_kernels import CONTROLS
from ribbonfem.jit.groups import groups_of
from ribbonfem.jit.references import by_reference
from ribbonfem.jit.simd import WIDTH
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.guess import GUESS, MEMORY

from .beam import PHI, ROWS, Beam, P, Solver


@by_reference
class Motion(NamedTuple):
    """State at the last accepted instant: u (G, ROWS, WIDTH), see `beam`; v, a, auxiliary (G, PHI, WIDTH).

    phi_rate (G, P + 1, WIDTH), rates of phi at the last kink; strain and strain_rate, see `law`.
    """

    u: Array
    v: Array
    a: Array
    auxiliary: Array
    phi_rate: Array
    strain: Array
    strain_rate: Array
    clock: Array


@by_reference
class Scratch(NamedTuple):
    """What a step overwrites, and the stages remembered for guesses.

    u, v, a as in `Motion`, of the stage; rp, vp, known: r = rp + b a, v = vp + f a, and what stands against
    sigma r (`residual`); stage_v, stage_a of all stages; known_u (MEMORY, G, ROWS, WIDTH), states with
    accelerations in place of positions, at known_time; controls (CONTROLS, 3); of a beam that retards
    strain, strain_rate and known_strain of a stage, and stage_strain_rate of all; of steps by means
    (`average_vector_field`) middle, as u, positions of the past, past (KEPT, G, PHI, WIDTH) at past_time, and
    out (2,).
    """

    u: Array
    v: Array
    a: Array
    rp: Array
    vp: Array
    known: Array
    stage_v: Array
    stage_a: Array
    known_time: Array
    known_u: Array
    lagrange: Array
    controls: Array
    strain: Array
    strain_rate: Array
    known_strain: Array
    stage_strain_rate: Array
    middle: Array
    past: Array
    past_time: Array
    out: Array


@by_reference
class Moving(NamedTuple):
    """A beam in motion.

    `row_x` (rows, nodes, 3), `row_bend` (rows, nodes), `row_v` (rows, nodes, 3) and `row_slope` (rows,) take
    positions, phi', velocities and, at midspan, sin phi of rows.
    """

    beam: Beam
    solver: Solver
    scratch: Scratch
    motion: Motion
    row_x: Array
    row_bend: Array
    row_v: Array
    row_slope: Array


def strains(elements: int, retards: bool) -> Array:
    """Strains of a beam (see `law`): of one that does not retard, none."""
    return np.zeros((groups_of(elements) if retards else 0, P, 2, WIDTH))


def scratch(elements: int, stages: int, retards: bool, past: int = 0) -> Scratch:
    """Memory for a mesh and a method, which looks back on so many steps."""
    groups = groups_of(elements)

    def zeros(*shape: int) -> Array:
        return np.zeros((*shape, WIDTH))

    return Scratch(
        u=zeros(groups, ROWS),
        v=zeros(groups, PHI),
        a=zeros(groups, PHI),
        rp=zeros(groups, PHI),
        vp=zeros(groups, PHI),
        known=zeros(groups, PHI),
        stage_v=zeros(stages, groups, PHI),
        stage_a=zeros(stages, groups, PHI),
        known_time=np.zeros(MEMORY),
        known_u=zeros(MEMORY, groups, ROWS),
        lagrange=np.zeros(GUESS),
        controls=np.zeros((CONTROLS, 3)),
        strain=strains(elements, retards),
        strain_rate=strains(elements, retards),
        known_strain=strains(elements, retards),
        middle=zeros(groups, ROWS),
        past=zeros(past, groups, PHI),
        past_time=np.zeros(past),
        out=np.zeros(2),
        stage_strain_rate=np.zeros((stages, *strains(elements, retards).shape)),
    )
