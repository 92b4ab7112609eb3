"""Public functions of the ribbon at rest in two parameters: curves of folds and of pitchforks."""

from __future__ import annotations

from ribbonfem.continuation import Steps
from ribbonfem.continuation.curves import ramp_events, ramp_folds, steps_for
from ribbonfem.continuation.two_parameters import fold_curve_of, pitchfork_curve_of
from ribbonfem.ends.second_parameter import SecondParameter
from ribbonfem.options import checked, options_given
from ribbonfem.results import FoldCurve, PitchforkCurve
from ribbonfem.scene import Scene

from . import states
from .functions import ELEMENTS
from .problem import checked_mesh

__all__ = ["fold_curve", "pitchfork_curve"]


@checked
def fold_curve(
    scene: Scene,
    *,
    over: str,
    span: tuple[float, float],
    which: int = 0,
    elements: int = ELEMENTS,
    extensible: bool = False,
    steps: Steps | None = None,
) -> FoldCurve:
    """One of the scene's folds over a second parameter, through the curve's turns and cusps.

    Parameters
    ----------
    scene: what is at rest, and the first parameter: its control.
    over: "compression" or "shear" of the scene, or another control that the drive does not move ("both" and
        "opposed" are two): where it stands, as a preset has it.
    span: from where to where it is followed, the scene's own value among it.
    which: the number of the fold in `folds`, from 0.
    elements, extensible, steps: as in `folds`.

    Raises
    ------
    SceneError, OptionError, SolverError
        As in `folds`; for a parameter, a span or a number that cannot be.

    Examples
    --------
    >>> ribbon = Scene(compression=0.30, shear=0.30, start="U+S+")
    >>> curve = fold_curve(ribbon, over="shear", span=(0.28, 0.32))
    >>> round(curve.cusps[0].parameter, 8), [round(point.control, 8) for point in curve.at(0.32)]
    (0.28374249, [-0.10681749, 0.05967916])
    """
    parameter = SecondParameter.of(scene, over, span)
    problem, start = states.named(scene, **checked_mesh(elements, extensible))
    events = ramp_folds(problem, start, scene, steps)
    of = {"model": "kirchhoff", "options": options_given()}
    return fold_curve_of(problem, events, which, scene, parameter, steps or steps_for(scene), **of)


@checked
def pitchfork_curve(
    scene: Scene,
    *,
    over: str,
    span: tuple[float, float],
    which: int = 0,
    elements: int = ELEMENTS,
    extensible: bool = False,
    steps: Steps | None = None,
) -> PitchforkCurve:
    """One of the scene's pitchforks over a second parameter that keeps its symmetry.

    Parameters and errors as in `fold_curve`; `which` is the number among those `instabilities` that are no
    folds.  A parameter that breaks the symmetry unfolds the pitchfork, and is refused.

    Examples
    --------
    >>> both = Scene(compression=0.20, shear=0.0, start="U+", drive="both")
    >>> curve = pitchfork_curve(both, over="compression", span=(0.05, 0.20))
    >>> [round(point.control / 0.1**0.5, 4) for point in curve.at(0.1)]
    [2.0192]
    """
    parameter = SecondParameter.of(scene, over, span)
    problem, start = states.named(scene, **checked_mesh(elements, extensible))
    events = ramp_events(problem, start, scene, steps)
    of = {"model": "kirchhoff", "options": options_given()}
    return pitchfork_curve_of(problem, events, which, scene, parameter, steps or steps_for(scene), **of)
