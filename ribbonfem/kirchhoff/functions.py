"""Public functions of the ribbon at rest: folds, equilibria, states, pitchforks, saddle (paper, section 3.1).

Frames are unit quaternions in continuous fifth-degree elements, interpolated and normalised; the
force in the rod, constant along it, is the multiplier of the position of its right end.  With p
Gauss points an element the fold angles converge with the power 2 p = 10 of the mesh, and lie
within 1e-9 rad at the default one.  `extensible=True` adds the stretching stiffness EA; the
curvatures are then per unit of undeformed length.

Lengths in L, angles in rad, forces in EI2/L^2, energies in EI2/L.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ribbonfem.continuation import Point, Steps
from ribbonfem.continuation.curves import (
    as_fold,
    instability_of,
    ramp_events,
    ramp_folds,
    span_of,
    steps_for,
    whole_curve,
)
from ribbonfem.continuation.saddles import saddle_beyond_fold
from ribbonfem.delay import NormalForm, ramp_normal_forms
from ribbonfem.options import checked, options_given
from ribbonfem.results import Array, Branch, Fold, Instability, RestState, SolverError
from ribbonfem.scene import Ribbon, Scene, SceneError

from . import out_of_plane as plane
from . import shear, states
from .discretisation import vibrations
from .frames import directors
from .problem import Frames, Statics, checked_mesh
from .reactions import reactions_of
from .shear import Pitchforks, ShearCurve

__all__ = [
    "Pitchforks",
    "RestState",
    "ShearCurve",
    "equilibria",
    "folds",
    "frequencies",
    "instabilities",
    "normal_forms",
    "pitchforks",
    "saddle",
    "shear_curves",
    "skipping_bound",
    "stable_states",
    "state",
]

ELEMENTS = 20


def _rest(problem: Statics, frames: Frames, angle: float, index: int, scene: Scene) -> RestState:
    height, slope, _ = problem.observe(frames, angle)
    return RestState(
        name=states.name_of(problem, frames, angle),
        control=float(angle),
        height=height,
        slope=slope,
        force=frames.force,
        energy=problem.energy(frames),
        index=index,
        s=problem.tables.nodes,
        positions=problem.positions(frames, angle),
        directors=directors(frames.g),
        scene=scene,
        reactions=reactions_of(problem, frames),
        **problem.profiles(frames),
    )


@checked
def folds(
    scene: Scene, *, elements: int = ELEMENTS, extensible: bool = False, steps: Steps | None = None
) -> tuple[Fold, ...]:
    """The folds that a very slow ramp meets: two from U+S+, one from U+S- and from the planar U+.

    From U+S+ it is one where the ribbon cannot stop in U+S- on its way, alpha_c1 > alpha_c2 (near
    the end of US), and where the curve of U+S+ is not that of U+S- (at (0.50, 0.45), say).

    Parameters
    ----------
    scene: of any shear.
    elements: an even number of at least 4; errors fall as elements^-10.
    extensible: whether the ribbon stretches, with EA of the scene's ribbon.
    steps: continuation step control.

    Raises
    ------
    SceneError
        If the start state is not a stable equilibrium; the message names those that are.
    OptionError, SolverError
        For a mesh that cannot be, a continuation that fails.

    Examples
    --------
    >>> path_2 = Scene(compression=0.40, shear=0.40, start="U+S+")
    >>> [round(fold.angle, 8) for fold in folds(path_2)]
    [0.160733, 0.44588463]
    """
    problem, start = states.named(scene, **checked_mesh(elements, extensible))
    of = {"model": "kirchhoff", "scene": scene, "options": options_given()}
    return tuple(as_fold(problem, event.point, **of) for event in ramp_folds(problem, start, scene, steps))


@checked
def instabilities(
    scene: Scene, *, elements: int = ELEMENTS, extensible: bool = False, steps: Steps | None = None
) -> tuple[Instability, ...]:
    """Where the state that a slow ramp follows is lost, in order: folds, up to the first that is none.

    At a "pitchfork" or a "branch" another curve crosses: a perfect ribbon stays on the lost state, a real one
    leaves it.  Parameters and errors as in `folds`.

    Examples
    --------
    >>> both = Scene(compression=0.40, shear=0, start="U+", drive="both")
    >>> instabilities(both)
    (Instability(subcritical pitchfork at alpha 1.21182617 rad, out of the plane, z(1/2) 0.199191579 L),)
    """
    problem, start = states.named(scene, **checked_mesh(elements, extensible))
    return _lost(problem, start, scene, steps, options_given())


def instabilities_from(
    scene: Scene, rest: Mapping[str, Array], *, elements: int, extensible: bool = False
) -> tuple[Instability, ...]:
    """`instabilities` of the state in which a motion begins, `History.rest`, in place of the `start`."""
    problem = states.in_control(scene, elements, extensible)
    frames = Frames(rest["g"], rest["force"], scene.begin)
    return _lost(problem, frames, scene, None, {"elements": elements, "extensible": extensible})


def _lost(
    problem: Statics, start: Frames, scene: Scene, steps: Steps | None, options: dict[str, Any]
) -> tuple[Instability, ...]:
    of = {"model": "kirchhoff", "options": options}
    result = ramp_events(problem, start, scene, steps)
    return tuple(instability_of(problem, event, scene, steps, of) for event in result)


@checked
def normal_forms(
    scene: Scene, *, elements: int = 8, extensible: bool = False, steps: Steps | None = None
) -> tuple[NormalForm, ...]:
    """The normal forms of the folds of `folds`: what `delay.predict` needs.

    The default mesh is that of `simulate`; parameters and errors as in `folds`.
    """
    problem, start = states.named(scene, **checked_mesh(elements, extensible))
    return ramp_normal_forms(problem, start, scene, steps)


@checked
def frequencies(scene: Scene, *, count: int = 6, elements: int = 12, extensible: bool = False) -> Array:
    """The lowest `count` angular frequencies (count,) of undamped motions about the start state, 1/s.

    Parameters and errors as in `folds`.
    """
    problem, start = states.named(scene, **checked_mesh(elements, extensible))
    return vibrations(problem, start, scene, count)


@checked
def leaves_plane(scene: Scene, *, elements: int = ELEMENTS, extensible: bool = False) -> float:
    """The control at which the planar state at rest loses its stability out of its plane.

    That of the first branch point across the plane, along the curve from the control's start in the direction
    of the scene's rate, to its `stop` or to the fold.  Parameters and errors as in `folds`.

    Returns
    -------
    NaN where it does not lose it.
    """
    scene.require_planar("leaves_plane")
    return plane.leaves_plane(scene, **checked_mesh(elements, extensible))


@checked
def equilibria(
    scene: Scene,
    *,
    elements: int = ELEMENTS,
    extensible: bool = False,
    span: tuple[float, float] | None = None,
    unstable: int = 2,
    steps: Steps | None = None,
) -> Branch:
    """The connected curve of equilibria through the start state, for controls in `span`.

    Parameters and errors as in `folds`; `span` with the control's start inside, by default (-1.5, 1.5) of
    angles, 30 EI2/L^2 of forces, .98 of what the chord allows of lengths: by default these go towards a taut
    ribbon as far as the mesh follows it.  The curve ends with the first state of more than `unstable`
    unstable directions.
    """
    problem, start = states.named(scene, **checked_mesh(elements, extensible))
    curve = whole_curve(problem, start, span, scene, steps or steps_for(scene), unstable)
    return curve.as_branch(scene, options_given(span=span or span_of(scene)), "kirchhoff", problem.arclength)


@checked
def state(scene: Scene, *, elements: int = ELEMENTS, extensible: bool = False) -> RestState:
    """The scene's start state at alpha = 0: stable, whatever the compression and shear.

    Found from the planar elastica, in closed form, by shearing it and by changing over at its
    pitchforks (paper, appendices A and B).  Parameters and errors as in `folds`.
    """
    problem, frames = states.named(scene, **checked_mesh(elements, extensible))
    return _rest(problem, frames, scene.begin, 0, scene)


@checked
def stable_states(scene: Scene, *, elements: int = ELEMENTS, extensible: bool = False) -> tuple[str, ...]:
    """Names of the scene's stable states at alpha = 0, whatever its `start`; () if there is none.

    Of those that U is connected to: a ribbon has other states, wound by whole turns.
    Parameters and errors as in `folds`.
    """
    return states.stable(scene, **checked_mesh(elements, extensible))


@checked
def pitchforks(
    compression: float,
    *,
    ribbon: Ribbon | None = None,
    elements: int = ELEMENTS,
    extensible: bool = False,
) -> Pitchforks:
    """The shears at which the states of a ribbon fork at alpha = 0 (paper, appendix B).

    Beyond dL/L = 0.905 or so the planar U is itself unstable, out of its plane; these are then on the mirror
    image of its curve, which turns back to the other side.

    Parameters
    ----------
    compression: dL/L, in (0, 1).
    ribbon: stiffness ratios; the default `Ribbon` if None.
    elements, extensible: as in `folds`.

    Raises
    ------
    SceneError, OptionError, SolverError
        As in `folds`.
    """
    scene = Scene(
        compression=compression, shear=0.0, start="U+", ribbon=Ribbon() if ribbon is None else ribbon
    )
    return shear.pitchforks(scene, **checked_mesh(elements, extensible))


@checked
def shear_curves(
    compression: float,
    *,
    ribbon: Ribbon | None = None,
    elements: int = ELEMENTS,
    extensible: bool = False,
) -> tuple[ShearCurve, ...]:
    """The states U, US and S at alpha = 0 against the shear, as far as 0.98 of the feasible one.

    z(1/2) against dW/L of the paper's appendix B.  Parameters and errors as in `pitchforks`.
    """
    scene = Scene(
        compression=compression, shear=0.0, start="U+", ribbon=Ribbon() if ribbon is None else ribbon
    )
    return shear.shear_curves(scene, **checked_mesh(elements, extensible))


def _pass(
    scene: Scene, angle: float, mesh: dict[str, Any], steps: Steps | None
) -> tuple[Scene, Statics, Point[Frames]]:
    """The saddle between U+S- and U- at an angle: see `saddle_beyond_fold`."""
    if scene.planar:
        raise SceneError("Scene.shear = 0.0: the saddle between U+S- and U- needs a sheared scene")
    scene = replace(scene, start="U+S-")
    problem, start = states.named(scene, **mesh)
    return scene, problem, saddle_beyond_fold(problem, start, angle, steps or steps_for(scene))


@checked
def saddle(
    scene: Scene,
    angle: float,
    *,
    elements: int = ELEMENTS,
    extensible: bool = False,
    steps: Steps | None = None,
) -> RestState:
    """The saddle between U+S- and U- at an angle: the lowest pass from the one to the other.

    It lies on the sheet that U+S- meets at its fold, and has one unstable direction.

    Parameters
    ----------
    scene: a sheared one; its `start` does not count.
    angle: alpha in rad, below that of the fold.
    elements, extensible, steps: as in `folds`.

    Raises
    ------
    SceneError, OptionError
        As in `folds`.
    SolverError
        If there is no such saddle at the angle.
    """
    scene, problem, point = _pass(scene, angle, checked_mesh(elements, extensible), steps)
    return _rest(problem, point.state, angle, 1, scene)


@checked
def skipping_bound(
    scene: Scene, *, elements: int = ELEMENTS, extensible: bool = False, steps: Steps | None = None
) -> float:
    """Energy of U+S+ at its fold alpha_c1 over that of the saddle to U- at the same angle, in EI2/L.

    Of the weight and the force at midspan too.  Where it is negative a ribbon that leaves the fold at rest
    cannot pass the saddle, so that U+S- is not skipped for its energy alone ("type 1" in the paper's
    section 7).

    Parameters and errors as in `saddle`.
    """
    mesh = checked_mesh(elements, extensible)
    upward = replace(scene, start="U+S+", rate=1.0, stop=None)
    problem, start = states.named(upward, **mesh)
    result = ramp_folds(problem, start, upward, steps)
    if not result:
        raise SolverError("U+S+ has no fold within a turn of the clamp, so that there is nothing to compare")
    first = result[0].point
    _, _, least = _pass(scene, first.parameter, mesh, steps)
    return problem.potential(first.state) - problem.potential(least.state)
