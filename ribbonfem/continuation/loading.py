"""What leads to a start: presets, loads and a natural shape, brought on together at rest."""

from __future__ import annotations

from ribbonfem.results import SolverError
from ribbonfem.scene import Scene, SceneError

from .corrector import Problem, State, Steps, first_point
from .curves import steps_for
from .tracing import trace


def brought_on(problem: Problem[State], state: State, scene: Scene, steps: Steps | None = None) -> State:
    """The state at share 1 of what acts at a scene's start, from that at 0, stable all the way.

    Parameters
    ----------
    problem: equilibrium equations whose parameter is the share.

    Raises
    ------
    SceneError
        If its stability is lost before; says at which share, and at what.
    """
    steps = steps or steps_for(scene)
    acting = ", ".join(
        [f"preset {name} = {value:g}" for name, value in scene.preset.items()]
        + [f"gravity = {scene.gravity}"] * any(scene.weight)
        + ["the natural shape"] * scene.ribbon.shaped
        + [f"the control's start {scene.begin:g}"] * (scene.begin != 0.0)
    )
    last = None
    try:
        first = first_point(problem, state, 0.0, 1.0)
        for segment in trace(problem, first, (-0.1, 1.0), steps):
            last = segment
            if segment.start.index == 0 and (segment.events or segment.end.index):
                kind = segment.events[0].kind if segment.events else "loss of stability"
                share = segment.events[0].point.parameter if segment.events else segment.end.parameter
                raise SceneError(
                    f"Scene.start = {scene.start!r}: the state loses stability while {acting} is increased "
                    f"from 0: a {kind} at {share:.6g} of it"
                )
    except SolverError as error:
        where = 0.0 if last is None else last.end.parameter
        raise SceneError(
            f"Scene.start = {scene.start!r}: the state cannot be followed while {acting} is increased from "
            f"0, beyond {where:.6g} of it: {error}"
        ) from None
    if last is None or last.end.parameter != 1.0:
        raise SceneError(
            f"Scene.start = {scene.start!r}: the curve of equilibria turns back while {acting} is increased "
            "from 0"
        )
    return problem.advance(last.end.state, 0.0 * last.end.direction, 1.0)
