"""The cheapest model that will do: which to run for one number of a scene, how fine, and why.

`choose` plans, from the measured laws of `compare.laws` and in a millisecond; `Choice.run` does it.
In order of cost:

* no run: the planar fold and its delay are known in closed form and from a table;
* the quasi-linear beam, where dL/L is small and the stretch does not count;
* the elastica, where the scene is planar and stays so: with bending and twisting stiffness above
  a bound its out-of-plane mode is stable up to the fold, below it the elastica's own second variation
  is asked; a scene that leaves its plane is refused;
* the folds and the predicted delay of a ribbon, where the ramp is so slow, and its damping so weak,
  that a run would have to follow a long vibration which cannot carry it over the barrier;
* a ribbon in motion by finite elements: one run inside of a measured law, which reads off itself whether
  it rattles, else each run checked by a finer one until the tolerance is met;
* discrete rods on two or more meshes, extrapolated, where the elements fail.

The reference of all errors is the ribbon as it is stated: in three dimensions and extensible.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import der
from ribbonfem import History, Scene, SceneError, SolverError, elastica, kirchhoff, quasilinear
from ribbonfem.delay import NormalForm
from ribbonfem.policy import call_of_a_scene, choice, flag, positive, refuse
from ribbonfem.results import Value
from ribbonfem.values import html_table, short_policy

from . import at_rest, climb, ladder
from .climb import CROSSINGS, Run, endless
from .laws import Laws, beam_units, shipped

QUANTITIES = (*CROSSINGS, "fold")

# Planar states are stable out of plane up to their fold, for dL/L up to the first number, if EI1/EI2 and
# GJ/EI2 are at least the others: more stiffness only adds to the second variation.
FLAT = (0.6, 20.0, 1.4)
# what a prediction leaves to the fold of the finite elements, rad
_STATIC = 1e-6
# error of the tabulated planar fold, rad
_TABULATED = 5e-6
# c a2 t*^4 of a ribbon's folds, typically
_PRODUCT = 1.5e5
# steps of a rod above which the ribbon's folds are cheaper than a run, and CPU seconds of the folds
_LONG, _FOLDS_SECONDS = 1.5e4, 1.0


@dataclass(frozen=True, repr=False, eq=False)
class Answer(Value):
    """One number of a scene, and what may be wrong with it.

    Attributes
    ----------
    value: rad; None where the ribbon does not snap.
    error: estimated, rad.
    met: whether `error` is within the tolerance asked for.
    sensitive: refinement does not settle the value: no single run decides it.
    seconds: CPU, of all runs.
    runs: what was run, in order; empty where a prediction was enough.
    history: of the finest run, or None.
    """

    value: float | None
    error: float
    met: bool
    sensitive: bool
    seconds: float
    runs: tuple[Run, ...]
    history: History | None

    def __repr__(self) -> str:
        found = "no such instant" if self.value is None else f"{self.value:.9g} rad"
        kept = "sensitive" if self.sensitive else "met" if self.met else "not met"
        return f"Answer({found}, to {self.error:.1e}: {kept}; {len(self.runs)} runs, {self.seconds:.3g} s)"

    def _repr_html_(self) -> str:
        rows = [(run.model, short_policy(run.policy), run.value, run.seconds) for run in self.runs]
        return html_table(repr(self), ("model", "policy", "angle (rad)", "CPU s"), rows)


@dataclass(frozen=True, repr=False, eq=False)
class Choice(Value):
    """The cheapest way to a number that meets a tolerance.

    Attributes
    ----------
    scene, quantity, tolerance, motion: what was asked.
    model: "prediction" (no run), "quasilinear", "elastica", "kirchhoff" or "folds" (a ribbon's fold and
        its predicted delay).
    policy: of the run, or of the first of several.
    estimate: expected error, rad.
    seconds: expected CPU seconds, on the machine that measured the laws.
    reason: in words.
    value: of a prediction, rad or None; None for all else.
    """

    scene: Scene
    quantity: str
    tolerance: float
    model: str
    policy: Mapping[str, Any]
    estimate: float
    seconds: float
    reason: str
    value: float | None = None
    motion: bool = False

    def __repr__(self) -> str:
        value = "" if self.value is None else f", {self.value:.9g} rad"
        return (
            f"Choice({self.model!r}{value} for {self.quantity!r} to {self.tolerance:g} rad; expected error "
            f"{self.estimate:.1e}, {self.seconds:.2g} s;\n  {self.reason})"
        )

    def run(self) -> Answer:
        """Do what was chosen.

        Raises
        ------
        SceneError, SolverError
            As the model does: for a start that is no stable equilibrium, a run that fails.
        """
        begin = time.process_time()
        if self.model == "prediction":
            settled = climb.Settled(self.value, self.estimate, False, (), None)
        elif self.quantity == "fold" and self.model in ("kirchhoff", "elastica"):
            settled = _static(self)
        elif self.model == "kirchhoff":
            settled = _by_elements(self)
        elif self.model == "folds":
            settled = _slow(self)
        elif "elements" in self.policy:
            settled = _once(self)
        else:
            settled = climb.stopped(self.scene, lambda scene: climb.beams(scene, self.tolerance))
        met = not settled.sensitive and settled.error <= self.tolerance
        seconds = time.process_time() - begin
        return Answer(
            settled.value, settled.error, met, settled.sensitive, seconds, settled.runs, settled.history
        )


@call_of_a_scene
def choose(scene: Scene, tolerance: float, quantity: str = "snap", *, motion: bool = False) -> Choice:
    """The cheapest model and resolution that give a number of a scene to a tolerance.

    Parameters
    ----------
    scene: planar or sheared; `stop` may be None: then the clamp turns until the snap.
    tolerance: rad.
    quantity: "snap", the angle at which z(1/2) first passes 0; "first snap", at which the mid
        tangent does (U+S+ to U+S-); "fold", the last fold that a very slow ramp meets.
    motion: whether the motion up to the snap is wanted too, and not the number alone.

    Raises
    ------
    PolicyError
        For a tolerance or a quantity that cannot be, or one that the scene does not have.
    SceneError
        If the motion is asked for and the scene has no `stop`; if the ribbon stays flat, or a planar
        one leaves its plane before its fold and the ramp's stop: a planar run would stay in it.
    """
    wanted = positive("tolerance", tolerance, 1.0)
    choice("quantity", quantity, QUANTITIES)
    for needed, letters in (("snap", "U"), ("first snap", "US")):
        if quantity == needed and not all(letter in scene.start for letter in letters):
            # a height, or a slope, that is zero at rest is crossed by rounding
            there = " and ".join(letters)
            refuse("quantity", quantity, f"needs a start with {there} in its name, not {scene.start!r}")
    if flag("motion", motion):
        choice("quantity", quantity, tuple(CROSSINGS))
        scene.require_stop()
    # the reference of all errors stretches
    scene.require_buckled()
    scene.require_isolated()
    laws = shipped()
    if scene.planar:
        require_plane(scene)
    if quantity == "fold":
        return _fold(scene, wanted, laws)
    if scene.planar:
        # the mid tangent of a planar beam is level at rest: it has no first snap of its own
        choice("quantity", quantity, ("snap",))
        return _planar(scene, wanted, motion, laws)
    return _ribbon(scene, wanted, quantity, motion, laws)


def _upward(scene: Scene) -> Scene:
    """A planar scene or its mirror image, whichever starts from U+."""
    return scene if scene.start == "U+" else scene.mirror


def _side(scene: Scene) -> float:
    return 1.0 if scene.start == "U+" else -1.0


def stays_planar(scene: Scene) -> bool:
    """Whether a planar state is stable out of the plane all the way to its fold, or the ramp's stop.

    From a measured bound of ramps towards the fold, else from the elastica's second variation.
    """
    largest, bending, twisting = FLAT
    ribbon = scene.ribbon
    stiff = ribbon.bending_ratio >= bending and ribbon.twist_ratio >= twisting
    if stiff and scene.compression <= largest and _upward(scene).rate > 0.0:
        return True
    return math.isnan(elastica.leaves_plane(scene, extensible=True))


def require_plane(scene: Scene) -> None:
    """Raise a `SceneError` if the state at rest leaves the plane before the scene's stop, or its fold."""
    if not stays_planar(scene):
        leaves = elastica.leaves_plane(scene, extensible=True)
        ribbon = scene.ribbon
        raise SceneError(
            f"Scene.shear = {scene.shear!r}: with bending_ratio = {ribbon.bending_ratio:.6g}, twist_ratio = "
            f"{ribbon.twist_ratio:.6g} the planar state at rest is unstable out of its plane from "
            f"{leaves:.6g} rad on, before it folds or the clamp stops; when it snaps depends on how far from "
            "planar it is: a shear, as small as it may be, is needed"
        )


def _fold(scene: Scene, tolerance: float, laws: Laws) -> Choice:
    if not scene.planar:
        reason = "a ribbon in three dimensions: geometrically exact elements, refined until meshes agree"
        return Choice(scene, "fold", tolerance, "kirchhoff", {"extensible": True}, tolerance, 0.5, reason)
    up = _upward(scene)
    if up.rate > 0.0 and not laws.planar.outside(up) and tolerance >= _TABULATED:
        value = _side(scene) * laws.planar.fold(up).angle
        if scene.stop is None or abs(value) < abs(scene.stop):
            reason = f"the planar fold is tabulated to {_TABULATED:g} rad"
            return Choice(scene, "fold", tolerance, "prediction", {}, _TABULATED, 1e-4, reason, value)
    reason = "planar and stable out of plane: the elastica's fold, refined until meshes agree"
    return Choice(scene, "fold", tolerance, "elastica", {"extensible": True}, tolerance, 0.1, reason)


def _planar(scene: Scene, tolerance: float, motion: bool, laws: Laws) -> Choice:
    def chosen(
        model: str, policy: Mapping[str, Any], error: float, seconds: float, reason: str, **more: Any
    ) -> Choice:
        return Choice(scene, "snap", tolerance, model, policy, error, seconds, reason, motion=motion, **more)

    up, side = _upward(scene), _side(scene)
    outside = "the ramp turns away from the fold" if up.rate < 0.0 else laws.planar.outside(up)
    if outside:
        reason = f"planar, but {outside}, where no law was measured: elasticas, each checked by a finer one"
        return chosen("elastica", {}, tolerance, 0.1, reason)
    found = laws.planar.predict(up)
    stop = math.inf if scene.stop is None else abs(scene.stop)
    known = f"predicted: the fold at {side * found.fold:.5f} and a delay of {found.delay:.2g} rad"
    if not motion and found.error <= tolerance:
        if found.angle + found.error < stop:
            small = found.delay <= tolerance
            reason = f"{known}, to {found.error:.1e}" + (
                "; the delay itself is below the tolerance" if small else ""
            )
            return chosen("prediction", {}, found.error, 1e-3, reason, value=side * found.angle)
        if found.angle - found.error > stop and scene.hold == 0.0:
            reason = f"{known}: the ramp stops before it snaps"
            return chosen("prediction", {}, 0.0, 1e-3, reason, value=None)
    for policy in laws.planar.policies:
        error = laws.planar.run_error(policy, up)
        if error <= tolerance:
            reason = f"a prediction is good to {found.error:.1e} only; " if not motion else "the motion: "
            if policy.model == "quasilinear":
                reason += f"dL/L is small enough for the quasi-linear beam, to {error:.1e}"
                rest = {"elements": policy.elements, "tolerance": policy.tolerance}
            else:
                reason += f"planar and stable out of plane: {policy.elements} elements of the elastica do, "
                reason += f"to {error:.1e}"
                rest = {
                    "elements": policy.elements,
                    "extensible": True,
                    "tolerance": policy.tolerance,
                }
            return chosen(policy.model, rest, error, laws.planar.seconds(policy), reason)
    reason = "finer than the laws were measured: elasticas, each checked by a finer one"
    return chosen("elastica", {}, tolerance, 0.5, reason)


def _ribbon(scene: Scene, tolerance: float, quantity: str, motion: bool, laws: Laws) -> Choice:
    steps = climb.expected_steps(scene)
    if _long_vibration(scene) and not motion and quantity == "snap" and steps > _LONG:
        uncertain = _slow_error(scene)
        if uncertain <= tolerance:
            reason = (
                f"a run would ring for some {steps:.0f} steps between its snaps: the last fold from finite "
                f"elements and the delay from its normal form, to {uncertain:.1e}, if the energy of the "
                "first snap is below the barrier; else a run"
            )
            return Choice(
                scene, quantity, tolerance, "folds", {}, uncertain, _FOLDS_SECONDS, reason, motion=motion
            )
    rung, bound = ladder.beginning(scene, tolerance, laws.elements)
    count, local = laws.elements.ladder[rung]
    first = f"sheared: {count} elements of the Kirchhoff rod at a tolerance of {local:g} L"
    if bound is not None:
        reason = f"{first} do, to {bound:.1e}, unless the run rattles: then finer ones check it"
        error, seconds = bound, laws.elements.seconds[rung]
    else:
        where = (
            "checked by a finer run"
            if ladder.covered(scene, laws.elements)
            else ("outside of what the law was measured for, each run checked by a finer one")
        )
        reason = f"{first}, {where}"
        error, seconds = laws.elements.typical[rung], sum(laws.elements.seconds[rung : rung + 2])
    policy = {"elements": count, "tolerance": local, "extensible": True}
    return Choice(scene, quantity, tolerance, "kirchhoff", policy, error, seconds, reason, motion=motion)


def _once(plan: Choice) -> climb.Settled:
    """A single run of a beam, whose error a law bounds."""
    model: Any = {"quasilinear": quasilinear, "elastica": elastica}[plan.model]
    policy = {**plan.policy, "until": "snap"}
    run, history = climb.timed(plan.model, model.simulate, endless(plan.scene), plan.quantity, policy)
    return climb.Settled(run.value, plan.estimate, False, (run,), history)


def _by_elements(plan: Choice) -> climb.Settled:
    """Elements on finer and finer meshes; rods after all where the elements fail."""

    def settle(scene: Scene) -> climb.Settled:
        return ladder.elements(
            scene, plan.quantity, plan.tolerance, shipped().elements, configurations=plan.motion
        )

    try:
        return climb.stopped(plan.scene, settle)
    except SolverError:
        return _climbed(plan)


def _climbed(plan: Choice, first: int = 1) -> climb.Settled:
    """Rods on finer and finer meshes."""

    def settle(scene: Scene) -> climb.Settled:
        return climb.rods(
            scene,
            plan.quantity,
            plan.tolerance,
            shipped().ribbon,
            first=first,
            configurations=plan.motion,
        )

    return climb.stopped(plan.scene, settle)


def _static(plan: Choice) -> climb.Settled:
    """The last fold of finite elements."""
    model: Any = {"kirchhoff": kirchhoff, "elastica": elastica}[plan.model]
    value, error, runs, _ = at_rest.folds(plan.model, model.folds, plan.scene, plan.tolerance)
    return climb.Settled(value, error, False, runs, None)


def _long_vibration(scene: Scene) -> bool:
    """Whether a ramp from U+S+ is so slow that its first snap is forgotten when the second comes."""
    _, rate, damping, _ = beam_units(scene)
    return scene.start == "U+S+" and scene.rate > 0.0 and damping * 0.2 / rate > 16.0


def _slow_error(scene: Scene) -> float:
    """What a ribbon's predicted delay will be wrong by, before its fold is known."""
    planar = shipped().planar
    form = NormalForm(0.0, _PRODUCT / scene.ribbon.inertial_time**4)
    return _STATIC + abs(1.0 - planar.typical_ratio(scene)) * planar.delay(form, scene.rate, scene.damping)


def _slow(plan: Choice) -> climb.Settled:
    """The last fold of Path 2 and its predicted delay; rods after all where energy may carry it over."""
    return _predicted(plan) or _by_elements(plan)


def _predicted(plan: Choice) -> climb.Settled | None:
    """The second snap of a slow Path 2 without a run; None where statics do not make it certain enough."""
    scene = replace(plan.scene, stop=None)
    fold, doubt, runs, folds = at_rest.folds("kirchhoff", kirchhoff.folds, scene, 0.3 * plan.tolerance)
    if fold is None or len(folds) != 2 or kirchhoff.skipping_bound(scene, extensible=True) >= 0.0:
        return None
    # the product of the normal form needs no more than a coarse mesh
    forms = der.normal_forms(scene, nodes=51)
    if len(forms) != 2:
        return None
    planar = shipped().planar
    delay = planar.delay(forms[-1], scene.rate, scene.damping)
    ratio = planar.typical_ratio(scene)
    value = fold + ratio * delay
    # the correction is the planar beam's: of the right sign and size, and no better
    error = doubt + abs(1.0 - ratio) * delay
    beyond = plan.scene.stop is not None and value + error > abs(plan.scene.stop)
    if error > plan.tolerance or beyond:
        return None
    return climb.Settled(value, error, False, runs, None)
