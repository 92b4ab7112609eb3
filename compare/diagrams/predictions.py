"""Predicted boundaries of a skipping diagram, from statics and one escape from a fold, without ramps.

Said for the ramp from U+S+ by the left clamp; of another rig U+S- is the state between its two folds, and
energies are with those of weight and force.

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
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator

from compare.models import MODELS
from compare.quantities.branches import outward, potential, span_to
from ribbonfem import Branch, SceneError, SolverError
from ribbonfem.delay import NormalForm, lead
from ribbonfem.delay.universal_curve import universal_fit
from ribbonfem.results import Array, control_text
from ribbonfem.scene import swapped

from .setup import Setup, mesh_of

TYPE_1 = "type 1: the energy of the first snap reaches the pass to U-"
TYPE_2 = "type 2: the delay at alpha_c1 reaches alpha_c2"
_CURVE, _SCAN, _ESCAPE = 25, 120, 1e-5
# part of the window between the folds within which two folds are the same
_SAME = 1e-3
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
    control: alpha_c1.
    late: the leading order of the delay, s, of a rate and a damping.
    lead: by how much t_z = 0 precedes the end of the normal form, s.
    energy: set free, over U+S- at alpha_c1, EI2/L.
    needed: the height of the pass over U+S-, EI2/L, of a control.
    period: of the lowest vibration of U+S-, s.
    """

    control: float
    late: Late
    lead: float
    energy: float
    needed: Pass
    period: float

    def spare(self, rate: Array, damping: Array) -> Array:
        """Logarithm of the energy at the pass over what it takes; infinite where the pass is gone."""
        there = self.late(rate, damping) - self.lead + 0.5 * self.period
        needed = self.needed(self.control + rate * there)
        there_is = needed > 0.0
        ratio = self.energy / np.where(there_is, needed, self.energy)
        return np.where(there_is, np.log(ratio) - damping * self.period, np.inf)


def _turns(branch: Branch) -> tuple[Array, Array, NDArray[np.int64]]:
    """Of a curve from its start on as the control grows: controls, energies, and the rows where it turns."""
    forth = outward(branch)
    control, energy = np.asarray(branch.control)[forth], potential(branch)[forth]
    return control, energy, np.flatnonzero(np.diff(np.sign(np.diff(control)))) + 1


@dataclass(frozen=True)
class Pass:
    """Energies (EI2/L) by controls of U+S-, `well`, and of the saddle from there to U-, `over`.

    NaN where there is none, and closer to their fold than the curve has points.
    """

    well: Callable[[Any], Array]
    over: Callable[[Any], Array]

    def __call__(self, control: Any) -> Array:
        """The height of the pass."""
        return np.asarray(self.over(control) - self.well(control))


def pass_of(branch: Branch) -> Pass:
    """The pass from U+S- to U-, from the curve through U+S-."""
    control, energy, turns = _turns(branch)
    # up along U+S-, and back along the saddle
    if not len(turns):
        raise SolverError("U+S- has no fold, so that there is no pass to U-")
    top, last = turns[0], turns[1] if len(turns) > 1 else len(control) - 1
    return Pass(
        well=PchipInterpolator(control[: top + 1], energy[: top + 1], extrapolate=False),
        over=PchipInterpolator(control[last:top:-1], energy[last:top:-1], extrapolate=False),
    )


def energy_at_fold(branch: Branch) -> float:
    """Energy (EI2/L) at the first fold of a curve as the control grows.

    There it is stationary along the curve as the control is: it follows from rows on both sides.
    """
    control, energy, turns = _turns(branch)
    if not len(turns):
        raise SolverError("the start has no fold")
    forth = outward(branch)
    rows = slice(max(turns[0] - 3, 0), turns[0] + 4)
    path = np.column_stack((control, np.asarray(branch.height)[forth], np.asarray(branch.slope)[forth]))[rows]
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1)))
    there = CubicSpline(along, path[:, 0]).derivative().roots(extrapolate=False)
    there = there[np.argmin(np.abs(there - along[turns[0] - rows.start]))]
    return float(CubicSpline(along, energy[rows])(there))


def swing(base: Setup, control: float, late: Late, mesh: Mapping[str, Any]) -> Swing:
    """The swing of a diagram's ribbon.

    Raises
    ------
    SceneError, SolverError
        If there is no U+S- where the control starts, or no pass from it at alpha_c1.
    """
    model: Any = MODELS[base.model]
    scene, (first, second) = base.scene, base.folds
    well = replace(scene, start=swapped(scene.start))
    curve = model.equilibria(well, span=span_to(well, second.control), **mesh)
    needed = pass_of(curve)
    met = [abs(fold.control - second.control) for fold in curve.folds]
    at = float(needed(control))
    if not at > 0.0 or min(met, default=np.inf) > _SAME * (second.control - first.control):
        where = control_text(scene, control)
        raise SolverError(f"no pass from {well.start} to the other side at {where}, the first fold")
    top = energy_at_fold(model.equilibria(scene, span=span_to(scene, control), **mesh))
    rest = float(needed.well(control))
    period = 2.0 * math.pi / float(model.frequencies(well, count=1, **mesh)[0])
    # to a thousandth of the period, at a third of the steps that the default takes
    before = lead(model, scene, 0, "first snap", tolerance=_ESCAPE, **mesh)[1].time
    return Swing(control, late, before, top - rest, needed, period)


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
    window = base.folds[1].control - base.folds[0].control
    curves, why = Curves(), ""
    mesh = mesh_of(base.model, base.options)
    try:
        form = model.normal_forms(base.scene, **mesh)[0]
        late = late_by(form)
        curves[TYPE_2] = _type_2(late, window, rates, dampings)
        middle = replace(base, scene=replace(base.scene, damping=math.sqrt(dampings[0] * dampings[-1])))
        curves[TYPE_1] = _type_1(swing(middle, form.angle, late, mesh), rates, dampings)
    except (SolverError, SceneError) as error:
        # a curve that statics do not give is not drawn
        why = " ".join(str(error).split())
    outside = {name: "not within these axes" for name, curve in curves.items() if not len(curve)}
    curves.missing = {name: why for name in (TYPE_2, TYPE_1) if name not in curves} | outside
    return curves
