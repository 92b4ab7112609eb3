"""`choose`: which model, mesh and tolerance give one number of a scene to an accuracy at least cost.

It chooses by the measured laws of `cost_laws`, in a millisecond; `Choice.run` runs it (`strategies`).
In order of cost:

* no run: the planar fold and its delay are known in closed form and from a table;
* one run of the elastica, where the scene is planar, of a measured error; of rigs for which it was not
  measured runs that check each other.  A run stays in the plane, and a scene that would leave it is refused.
  With bending and twisting stiffness above a bound the out-of-plane mode is stable up to the fold, below it
  the elastica's own second variation is asked;
* the folds and the predicted delay of a ribbon, where the ramp is so slow, and its damping so weak,
  that a run would have to follow a long vibration which cannot carry it over the barrier;
* a ribbon in motion by elements of the Kirchhoff rod, in the same way; a run reads off itself whether it
  vibrates, and is checked by two others then, and by finer ones until the tolerance is met;
* discrete rods on two or more meshes, extrapolated, where the elements fail.

The reference of all errors is the ribbon as it is stated: in three dimensions and extensible.
"""

from __future__ import annotations

import math

from compare.quantities.measure import require_monotone
from ribbonfem import Scene, SceneError, elastica
from ribbonfem.options import call_of_a_scene, choice, flag, positive, refuse, shown
from ribbonfem.results import control_text

from . import levels, predicted, refinement
from .cost_laws import Laws, shipped
from .refinement import CROSSINGS
from .strategies import AtRest, Choice, Elements, Known, Slow

QUANTITIES = (*CROSSINGS, "fold")

# Planar states are stable out of plane up to their fold, for dL/L up to the first number, if EI1/EI2 and
# GJ/EI2 are at least the others: more stiffness only adds to the second variation.
FLAT = (0.6, 20.0, 1.4)
# error of the tabulated planar fold, rad
_TABULATED = 5e-6
# steps of a rod above which the ribbon's fold and its delay are cheaper than a run, and their CPU seconds
_LONG, _SLOW_SECONDS = 7e3, 1.5


@call_of_a_scene
def choose(scene: Scene, tolerance: float, quantity: str = "snap", *, motion: bool = False) -> Choice:
    """The cheapest model and resolution that give a number of a scene to a tolerance.

    Parameters
    ----------
    scene: planar or sheared; `stop` may be None: then the clamp turns until the snap.
    tolerance: rad.
    quantity: "snap", the angle at which z(1/2) first passes 0; "first snap", at which the mid
        tangent does (U+S+ to U+S-); "snap time", when (s) it snaps, which
        alone tells an instant at which the control stands still; "fold", the last fold that a very
        slow ramp meets.
    motion: whether the motion up to the snap is wanted too, and not the number alone.

    Raises
    ------
    OptionError
        For a tolerance or a quantity that cannot be, or one that the scene does not have.
    SceneError
        If the motion is asked for and the scene has no `stop`; if the ribbon stays flat, or a planar
        one leaves its plane before its fold and the ramp's stop: a planar run would stay in it.

    Examples
    --------
    >>> from ribbonfem import Scene
    >>> beam = Scene(compression=0.40, shear=0.0, start="U+", rate=0.1, stop=1.4)
    >>> answer = choose(beam, tolerance=1e-3).run()
    >>> round(answer.value, 3), answer.met
    (1.16, True)
    """
    wanted = positive("tolerance", tolerance, 1.0)
    choice("quantity", quantity, QUANTITIES)
    for needed, letters in (("snap", "U"), ("first snap", "US")):
        if quantity == needed and not all(letter in scene.start for letter in letters):
            # a height, or a slope, that is zero at rest is crossed by rounding
            there = " and ".join(letters)
            refuse("quantity", quantity, f"needs a start with {there} in its name, not {scene.start!r}")
    require_monotone(scene, quantity)
    if flag("motion", motion):
        choice("quantity", quantity, tuple(CROSSINGS))
        scene.require_stop()
    # the reference of all errors stretches
    scene.require_buckled()
    scene.require_isolated()
    laws = shipped()
    if not scene.usual or quantity == "snap time":
        return _other_rig(scene, wanted, quantity, motion)
    if scene.planar:
        require_plane(scene)
    if quantity == "fold":
        return _fold(scene, wanted, laws)
    if scene.planar:
        # the mid tangent of a planar beam is level at rest: it has no first snap of its own
        choice("quantity", quantity, ("snap",))
        return _planar(scene, wanted, motion, laws)
    return _ribbon(scene, wanted, quantity, motion)


def _other_rig(scene: Scene, tolerance: float, quantity: str, motion: bool) -> Choice:
    """A scene for which no law was measured: runs that check each other."""
    name = levels.model_of(scene)
    result = levels.MODELS[name].instabilities(scene, extensible=True)
    lost = next((point for point in result if point.kind != "fold"), None)
    if lost is not None:
        where = control_text(scene, lost.control)
        raise SceneError(
            f"Scene.drive = {scene.drive!r}: at {where} the state at rest loses stability at a {lost.kind}"
            f"{' out of its plane' if lost.out_of_plane else ''}. A run without imperfection stays on the "
            "unstable state, and the snap depends on the imperfection. Give one: a small preset"
        )
    if quantity == "fold":
        reason = f"with {_beyond(scene)}: geometrically exact elements, refined until meshes agree"
        return AtRest(scene, "fold", tolerance, name, {"extensible": True}, tolerance, 0.5, reason)
    what = f"of the {quantity}" if scene.usual else f"with {_beyond(scene)}"
    return _elements(scene, tolerance, quantity, f"no law was measured {what}", motion)


def _beyond(scene: Scene) -> str:
    """What a scene has that the laws were measured without: they are of one clamp at a constant rate."""
    acts = {
        "presets": bool(scene.preset),
        "weight": any(scene.weight),
        "a natural shape": scene.ribbon.shaped,
        "retardation": scene.ribbon.retardation != 0.0,
        "a schedule": scene.schedule is not None,
        f"drive = {shown(scene.drive)}": scene.drive not in ("left", "right"),
    }
    return ", ".join(name for name, there in acts.items() if there)


def _side(scene: Scene) -> float:
    return 1.0 if scene.start == "U+" else -1.0


def stays_planar(scene: Scene) -> bool:
    """Whether a planar state is stable out of the plane all the way to its fold, or the ramp's stop.

    From a measured bound of ramps towards the fold, else from the elastica's second variation.
    """
    largest, bending, twisting = FLAT
    ribbon = scene.ribbon
    stiff_enough = ribbon.bending_ratio >= bending and ribbon.twist_ratio >= twisting
    if stiff_enough and scene.compression <= largest and refinement.upward(scene).rate > 0.0:
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
            f"{leaves:.6g} rad on, before it folds or the clamp stops. The snap then depends on the "
            "imperfection. Give one: a small shear"
        )


def _fold(scene: Scene, tolerance: float, laws: Laws) -> Choice:
    if not scene.planar:
        reason = "a ribbon in three dimensions: geometrically exact elements, refined until meshes agree"
        return AtRest(scene, "fold", tolerance, "kirchhoff", {"extensible": True}, tolerance, 0.5, reason)
    up = refinement.upward(scene)
    if up.rate > 0.0 and not laws.planar.outside(up) and tolerance >= _TABULATED:
        value = _side(scene) * laws.planar.fold(up).angle
        if scene.stop is None or abs(value) < abs(scene.stop):
            reason = f"the planar fold is tabulated to {_TABULATED:g} rad"
            return Known(scene, "fold", tolerance, "prediction", {}, _TABULATED, 1e-4, reason, value)
    reason = "planar and stable out of plane: the elastica's fold, refined until meshes agree"
    return AtRest(scene, "fold", tolerance, "elastica", {"extensible": True}, tolerance, 0.1, reason)


def _planar(scene: Scene, tolerance: float, motion: bool, laws: Laws) -> Choice:
    def known(value: float | None, error: float, reason: str) -> Choice:
        return Known(scene, "snap", tolerance, "prediction", {}, error, 1e-3, reason, value, motion)

    def refined(why: str) -> Choice:
        return _elements(scene, tolerance, "snap", f"planar, {why}", motion)

    up, side = refinement.upward(scene), _side(scene)
    outside = "the ramp turns away from the fold" if up.rate < 0.0 else laws.planar.outside(up)
    if outside:
        return refined(f"but {outside}, where no prediction was checked")
    if motion:
        return refined("and the motion is wanted")
    result = laws.planar.predict(up)
    stop = math.inf if scene.stop is None else abs(scene.stop)
    if result.error > tolerance:
        return refined(f"a prediction has an error of {result.error:.1e}")
    parts = f"predicted: the fold at {side * result.fold:.5f} and a delay of {result.delay:.2g} rad"
    if result.angle + result.error < stop:
        small = "; the delay itself is below the tolerance" if result.delay <= tolerance else ""
        return known(side * result.angle, result.error, f"{parts}, error {result.error:.1e}{small}")
    if result.angle - result.error > stop and scene.hold == 0.0:
        return known(None, 0.0, f"{parts}: the ramp stops before it snaps")
    return refined("and it may stop before it snaps")


def _elements(scene: Scene, tolerance: float, quantity: str, why: str, motion: bool) -> Choice:
    """A run whose error is known, else runs that check each other."""
    model, law = levels.model_of(scene), levels.alone(scene, tolerance)
    whose = "elastica" if scene.planar else "Kirchhoff rod"
    if law:
        count, local, error, seconds = law
        reason = f"{why}: {count} elements of the {whose}, steps to {local:.3g} L, expected error "
        reason += f"{error:.1e} rad"
        reason += "" if scene.planar else "; if it still vibrates from its first snap, finer runs check it"
    else:
        (count, local), (_, finer), *_ = levels.first_runs(scene, tolerance)
        error, seconds = levels.scatter(scene, finer), levels.seconds(scene, tolerance)
        reason = f"{why}: elements of the {whose}, each run checked by a finer one"
    options = {"elements": count, "tolerance": local, "extensible": True}
    return Elements(scene, quantity, tolerance, model, options, error, seconds, reason, motion=motion)


def _ribbon(scene: Scene, tolerance: float, quantity: str, motion: bool) -> Choice:
    steps = refinement.expected_steps(scene)
    if steps > _LONG and not motion and predicted.forgets(scene, quantity):
        uncertain = predicted.expected_error(scene)
        if uncertain <= tolerance:
            reason = (
                f"a run would vibrate for some {steps:.0f} steps before it snaps. The fold comes from finite "
                f"elements, the delay from theory to its next order, with an error of about {uncertain:.1e} "
                "rad; where that does not do, a run"
            )
            return Slow(scene, quantity, tolerance, "folds", {}, uncertain, _SLOW_SECONDS, reason)
    return _elements(scene, tolerance, quantity, "sheared", motion)
