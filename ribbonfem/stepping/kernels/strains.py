"""Strain rates of a material with retardation at the stages of a method.

A body has offset, natural, stiffness, compliance, elastic and retardation (`ribbonfem.material.kernels`); its
state at an instant strain and strain_rate, its scratch known_strain and stage_strain_rate.
"""

from __future__ import annotations

from typing import Any

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import OPTIONS
from ribbonfem.linalg.array_ops import add, copy
from ribbonfem.material.kernels import count_from, count_with
from ribbonfem.results import Array

from .arrays import DIRK, Scheme


@compiled(**OPTIONS)
def know_strains(body: Any, m: Scheme, y: Any, t: Any, i: int, h: float, f: float) -> None:
    """What a stage knows of the strains, in t.known_strain, and its law; strain = known + f rate."""
    copy(y.strain, t.known_strain)
    if m.kind != DIRK:
        add(y.strain_rate, 0.5 * h, t.known_strain)
    else:
        for j in range(i):
            add(t.stage_strain_rate[j], h * m.a[i, j], t.known_strain)
    count_from(
        body.offset,
        body.natural,
        t.known_strain,
        body.stiffness,
        body.compliance,
        body.elastic,
        body.retardation / f,
    )


@compiled(**OPTIONS)
def put_rates(t: Any, f: float) -> None:
    """Rates of the strains of a stage that is solved, t.strain, in t.strain_rate."""
    for k in range(t.strain.size):
        t.strain_rate.flat[k] = (t.strain.flat[k] - t.known_strain.flat[k]) / f


@compiled(**OPTIONS)
def know_rates(body: Any, rate: Array) -> None:
    """The law where strain rates are known."""
    count_with(
        body.offset, body.natural, rate, body.stiffness, body.compliance, body.elastic, body.retardation
    )
