"""Predicted boundaries of a skipping diagram, from statics and one escape from a fold, without ramps.

Type 2: the first snap is so late that U+S- is gone.  Its delay at alpha_c1, from the fold's normal form,
reaches alpha_c2 on a curve in rate and damping.  It holds where damping is weak: a damped ribbon creeps
on towards U+S- for a while, and skips it at lower rates.  (It is the leading order of `ribbonfem.delay`,
the instant at which the normal form blows up.  The next order's is that of t_z = 0, which comes before
it is decided where the ribbon goes.)

Type 1: the energy that the first snap sets free carries the ribbon over the pass from U+S- to U-.  Released
at alpha_c1, it loses exp(-nu T) on its first swing, T the period of U+S-; the pass is that of the angle
at which the ribbon gets there, half a period behind the first snap.  It holds where energy abounds (within
15 % where the first snap frees ten times what the pass needs); where it hardly suffices the ribbon has to
find its way over in several swings, and the curve lies above the true one: no type 1 beyond it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from compare.models import MODELS
from compare.quantities.branches import outward
from ribbonfem import Branch, SolverError
from ribbonfem.delay import NormalForm, lead
from ribbonfem.delay.universal_curve import universal_fit
from ribbonfem.results import Array

from .setup import Setup, mesh_of

TYPE_1 = "type 1: the energy of the first snap reaches the pass to U-"
TYPE_2 = "type 2: the delay at alpha_c1 reaches alpha_c2"
_CURVE, _SCAN, _ESCAPE = 25, 120, 1e-5
# delay (s) by rates and dampings
Late = Callable[[Array, Array], Array]


def late_by(form: NormalForm) -> Late:
    """The leading order of the delay (s) by rates and dampings."""

    def late(rate: Array, damping: Array) -> Array:
        tau = (form.product * rate) ** -0.2
        return np.asarray(tau * universal_fit(damping * tau))

    return late


def _type_2(late: Late, window: float, rates: Array, dampings: Array) -> Array:
    """Rate at which the delay equals the window between the folds, by damping; rows within the axes."""
    damping = np.geomspace(dampings[0], dampings[-1], _CURVE)
    rate = np.geomspace(rates[0], rates[-1], _SCAN)
    # the angle by which a ramp is late grows with its rate: as a power of it between two of these
    beyond = np.log(rate * late(rate, damping[:, None]) / window)
    result = [
        (math.exp(np.interp(0.0, row, np.log(rate))), float(nu))
        for row, nu in zip(beyond, damping, strict=True)
        if row[0] < 0.0 < row[-1]
    ]
    return np.array(result).reshape(-1, 2)


@dataclass(frozen=True)
class Swing:
    """What a ribbon that leaves U+S+ at its fold needs to pass U+S-.

    Attributes
    ----------
    angle: alpha_c1, rad.
    late: the leading order of the delay, s, of a rate and a damping.
    lead: by how much t_z = 0 precedes the end of the normal form, s.
    energy: set free, over U+S- at alpha_c1, EI2/L.
    needed: of an angle, the height of the pass over U+S-, EI2/L; NaN where there is none.
    period: of the lowest vibration of U+S-, s.
    """

    angle: float
    late: Late
    lead: float
    energy: float
    needed: Callable[[Array], Array]
    period: float

    def spare(self, rate: Array, damping: Array) -> Array:
        """Logarithm of the energy at the pass over what it takes; infinite where the pass is gone."""
        there = self.late(rate, damping) - self.lead + 0.5 * self.period
        needed = self.needed(self.angle + rate * there)
        there_is = needed > 0.0
        ratio = self.energy / np.where(there_is, needed, self.energy)
        return np.where(there_is, np.log(ratio) - damping * self.period, np.inf)


def pass_of(branch: Branch) -> Callable[[Array], Array]:
    """Energy of the saddle to U- over U+S- by angles, from the curve through U+S-.

    NaN where there is none, and closer to their fold than the curve has points.
    """
    angle, energy = np.asarray(branch.angle), np.asarray(branch.energy)
    forth = outward(branch)
    angle, energy = angle[forth], energy[forth]
    # up along U+S-, and back along the saddle
    turns = np.flatnonzero(np.diff(np.sign(np.diff(angle)))) + 1
    if not len(turns):
        raise SolverError("U+S- has no fold, so that there is no pass to U-")
    top, last = turns[0], turns[1] if len(turns) > 1 else len(angle) - 1
    well = PchipInterpolator(angle[: top + 1], energy[: top + 1], extrapolate=False)
    over = PchipInterpolator(angle[last:top:-1], energy[last:top:-1], extrapolate=False)
    return lambda at: np.asarray(over(at) - well(at))


def swing(base: Setup, angle: float, late: Late, mesh: Mapping[str, Any]) -> Swing:
    """The swing of a diagram's ribbon.

    Raises
    ------
    SolverError
        If U+S- has no fold, or its curve no pass at alpha_c1.
    """
    model: Any = MODELS[base.model]
    well = replace(base.scene, start="U+S-", rate=1.0)
    needed = pass_of(model.equilibria(well, **mesh))
    at = float(needed(np.asarray(angle)))
    if not at > 0.0:
        raise SolverError(f"no pass from U+S- to U- at alpha_c1 = {angle:.6g}")
    energy = at + model.skipping_bound(base.scene, **mesh)
    period = 2.0 * math.pi / float(model.frequencies(well, count=1, **mesh)[0])
    # to a thousandth of the period, at a third of the steps that the default takes
    before = lead(model, base.scene, 0, "first snap", tolerance=_ESCAPE, **mesh)[1].time
    return Swing(angle, late, before, energy, needed, period)


def _type_1(ribbon: Swing, rates: Array, dampings: Array) -> Array:
    """The largest damping at which the first swing still reaches the pass, by rate; rows within the axes."""
    scan = np.geomspace(dampings[-1], dampings[0], _SCAN)
    rate = np.geomspace(rates[0], rates[-1], _CURVE)
    result = []
    for at, spare in zip(rate, ribbon.spare(rate[:, None], scan), strict=True):
        ends = np.flatnonzero((spare[:-1] <= 0.0) & (spare[1:] > 0.0) & (spare[1:] < np.inf))
        if len(ends):
            k = ends[0]
            share = spare[k] / (spare[k] - spare[k + 1])
            result.append((float(at), float(scan[k] * (scan[k + 1] / scan[k]) ** share)))
    return np.array(result).reshape(-1, 2)


class Curves(dict[str, Array]):
    """Curves (k, 2) of rates and dampings by name; `missing` says by name why one is not there."""

    missing: Mapping[str, str] = MappingProxyType({})


def predictions(base: Setup, rates: Array, dampings: Array) -> Curves:
    """What statics say of the lines in a diagram; what they do not offer is left out, and why is told."""
    model: Any = MODELS[base.model]
    window = base.folds[1].angle - base.folds[0].angle
    curves, why = Curves(), ""
    if window <= 0.0:
        why = "U+S- is gone before U+S+ is: nothing is skipped"
    elif not hasattr(model, "normal_forms"):
        why = "the model has no normal forms"
    else:
        mesh = mesh_of(base.model, base.options)
        try:
            form = model.normal_forms(base.scene, **mesh)[0]
            late = late_by(form)
            curves[TYPE_2] = _type_2(late, window, rates, dampings)
            middle = replace(base, scene=replace(base.scene, damping=math.sqrt(dampings[0] * dampings[-1])))
            curves[TYPE_1] = _type_1(swing(middle, form.angle, late, mesh), rates, dampings)
        except SolverError as error:
            # a curve that statics do not give is not drawn
            why = " ".join(str(error).split())
    outside = {name: "not within these axes" for name, curve in curves.items() if not len(curve)}
    curves.missing = {name: why for name in (TYPE_2, TYPE_1) if name not in curves} | outside
    return curves
