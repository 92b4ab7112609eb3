"""The snap or the fold of one scene, by the cheapest model that meets a tolerance, with its error."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

from compare.archive import for_programs
from compare.chooser.choice import choose
from compare.chooser.refinement import endless
from compare.chooser.strategies import Answer, Choice
from compare.models import MODELS
from compare.report.section import Drawing, Picture, Table
from compare.sweep import Progress, Sweep
from ribbonfem import History, Scene, SceneError, SolverError
from ribbonfem.continuation.curves import span_of
from ribbonfem.options import whole_number
from ribbonfem.output import vtu
from ribbonfem.output.curve import Curve
from ribbonfem.output.film import film
from ribbonfem.output.page import view
from ribbonfem.output.scene_file import read_scene
from ribbonfem.output.style import control_label, figure

from ..report.registry import Command

# exit status where the answer is not within the tolerance, and where refinement does not settle it
NOT_MET, SENSITIVE = 3, 4
# rad; how far a ramp without a stop is shown to turn past its last fold and its snap
_PAST = 0.1
# a motion has come to rest when its amplitude is exp(-7), a thousandth
_DECAYS = 7.0
# periods of the lowest vibration; what is damped so little that it rings longer is shown that long
_PERIODS = 60.0


@dataclass(frozen=True)
class RunResult:
    """What was found: the way that was chosen, and the answer.

    `file` is the scene's, `curve` the equilibria behind its film, where there is one, of `frames`.
    """

    file: str
    choice: Choice
    answer: Answer
    curve: Curve | None = None
    frames: int = 150


def _draw(result: RunResult) -> Any:
    """z(1/2) of the finest run against the angle, with the answer."""
    history, value = result.answer.history, result.answer.value
    fig, axes = figure(1, width=5.0)
    if history is not None:
        axes.plot(history.control, history.height)
    if value is not None and result.choice.quantity != "snap time":
        axes.axvline(value, color="0.5", lw=0.8)
        axes.axhline(0.0, color="0.8", lw=0.8)
    scene = result.choice.scene
    axes.set_title(f"dL/L {scene.compression:g}, dW/L {scene.shear:g}, {scene.start}", fontsize=9)
    axes.set(xlabel=control_label(scene), ylabel="$z(1/2)/L$")
    return fig


def _sentence(choice: Choice, answer: Answer) -> str:
    what, unit = choice.quantity, f" {answer.unit}".rstrip()
    if answer.sensitive:
        result = "nothing" if answer.value is None else f"{answer.value:.6f}{unit}"
        return (
            f"SENSITIVE: the {what} does not converge under refinement; the last run gave {result}, and runs "
            f"differ by some {answer.error:.1e}{unit}. No single run decides it."
        )
    if answer.value is None:
        stop, moves = choice.scene.stop, choice.scene.clamps_turn
        if choice.scene.schedule is not None:
            until = f"in the {choice.scene.duration:g} s of the schedule"
        elif stop is None:
            until = "within a full turn of the clamp" if moves else "as far as the control is followed"
        else:
            mover = "the clamp" if moves else "the control"
            until = f"before {mover} stops at {stop:g} {choice.scene.drives.unit}".rstrip()
        held = f", nor while it is held for {choice.scene.hold:g} s" if stop and choice.scene.hold else ""
        return f"no {what} {until}{held}."
    kept = "within" if answer.met else "NOT within"
    return (
        f"{what} at {answer.value:.7f}{unit}, to {answer.error:.1e}{unit}: {kept} the tolerance of "
        f"{choice.tolerance:g}."
    )


def main(
    scene: Path,
    *,
    tolerance: float = 1e-3,
    quantity: Literal["snap", "first snap", "snap time", "fold"] = "snap",
    motion: bool = False,
    frames: int = 150,
    sweep: Sweep | None = None,
) -> RunResult:
    """Compute where or when a scene snaps or folds, by the cheapest model that meets --tolerance.

    The scene is read from a TOML file: the fields of a Scene, and a table [ribbon]. --quantity is the control
    (the clamp angle in rad, or what else the scene drives) at the "snap" (the height z at midspan passes 0),
    at the "first snap" (the z-component of the tangent at midspan passes 0) or at the "fold" (the last one
    that a very slow ramp meets), or the "snap time" in s. --motion also writes an interactive view
    (run-view.html), a film (run-film.gif) of so many --frames, and as many files for ParaView
    (run-vtu/motion.pvd). The motion ends with the snap; if the scene has no `stop`, it goes on until it has
    decayed.
    """
    whole_number("frames", frames, 2)
    stated = read_scene(scene)
    # a motion needs a stop: it ends with the snap, and of a scene without one is gone on with then
    choice = choose(endless(stated) if motion else stated, tolerance, quantity, motion=motion)
    progress = sweep.progress if sweep else Progress()
    (answer,) = (choice.run() for _ in progress("scene", [stated]))
    curve, history = None, answer.history
    if history is not None and motion:
        history = to_rest(stated, history) if stated.stop is None else history
        answer, curve = replace(answer, history=history), curves_of(history)
    return RunResult(str(scene), choice, answer, curve, frames)


def _mesh(history: History, *names: str) -> dict[str, Any]:
    return {name: history.options[name] for name in names if name in history.options}


def to_rest(stated: Scene, history: History) -> History:
    """The motion of a scene without a stop, past its snap and the last fold of a turn, held until it rests.

    Parameters
    ----------
    stated: the scene, without a stop.
    history: of its ramp, until it has snapped; the same if it has not, or where it cannot be gone on with.
    """
    if history.crossing() is None and history.crossing("slope") is None:
        return history
    model: Any = MODELS[history.model]
    mesh = _mesh(history, "extensible", "clamp")
    try:
        # (a clamp turned round and round meets folds again and again)
        met = (abs(fold.control) for fold in model.folds(stated, **mesh))
        reached = [control for control in met if control < abs(endless(stated).require_stop())]
        pulse = float(model.frequencies(stated, count=1, **mesh)[0])
        # under, and over critical damping
        decay = max(2.0 / stated.damping, stated.damping / pulse**2) if stated.damping else math.inf
        hold = min(_DECAYS * decay, _PERIODS * 2.0 * math.pi / pulse)
        stop = math.copysign(max([*reached, abs(float(history.control[-1]))]) + _PAST, stated.rate)
        scene = replace(stated, stop=stop, hold=hold)
        whole: History = model.simulate(scene, **{**history.options, "until": "end"})
    except (SceneError, SolverError):
        return history
    return whole


def curves_of(history: History) -> Curve | None:
    """The curve of equilibria through the start of a motion and its mirror image, on which it may land.

    The image under z -> -z has the controls of the other sign; where weight, a natural shape, presets or
    another drive make the image another rig it is no curve of states.  None where it cannot be followed.
    """
    scene = replace(history.scene, stop=None, hold=0.0)
    span = span_of(scene)
    if scene.clamps_turn:
        reach = max(1.5, float(abs(history.control).max()))
        span = min(span[0], -reach), max(span[1], reach)
    try:
        branch = MODELS[history.model].equilibria(
            scene, unstable=1, span=span, **_mesh(history, "extensible", "clamp")
        )
    except (SceneError, SolverError):
        return None
    curve, drives = Curve.of(branch), scene.drives
    if scene.dressed or not drives.reversed_by_mirror or drives.mirror != drives:
        return curve
    return Curve.joined((curve, curve.mirrored()))


def summary(result: RunResult) -> list[str]:
    """The answer, and the reason for the model chosen."""
    reason = result.choice.reason
    return [
        _sentence(result.choice, result.answer),
        f"Chosen: {result.choice.model}. {reason[:1].upper()}{reason[1:]}.",
    ]


def tables(result: RunResult) -> Iterator[Table]:
    """The runs that the answer took."""
    rows: list[list[Any]] = [
        [run.model, ", ".join(f"{name} {value}" for name, value in run.options.items() if name != "until")]
        + [run.value, run.seconds]
        for run in result.answer.runs
    ]
    if rows:
        yield Table(
            "Runs",
            ["model", "options", f"{result.choice.quantity} ({result.answer.unit or 1})", "CPU s"],
            rows,
            ["s", "s", ".7f", ".3f"],
            f"{result.answer.seconds:.3f} s in all.",
        )


def drawings(result: RunResult) -> Iterator[Drawing]:
    """The motion, where there was one."""
    if result.answer.history is not None:
        caption = "Height at midspan against the control, of the finest run."
        yield Drawing("run-motion.png", caption, _draw(result))


def films(result: RunResult) -> Iterator[Picture]:
    """The motion to turn by hand, and its film, where it was asked for."""
    if result.choice.motion and result.answer.history is not None:
        until = (
            "to rest"
            if result.choice.scene.hold == 0.0 < result.answer.history.scene.hold
            else "up to its snap"
        )
        yield Picture("run-view.html", f"The motion {until}, to be turned and run through by hand.")
        yield Picture("run-film.gif", f"The ribbon in motion, {until}; its frames for ParaView: run-vtu.")


def export(result: RunResult, folder: Path, progress: Progress) -> None:
    """The interactive view, the film, and VTU frames with a PVD."""
    history = result.answer.history
    if result.choice.motion and history is not None:
        view(history, folder / "run-view.html", result.curve)
        count = result.frames
        film(
            history,
            folder / "run-film.gif",
            curve=result.curve,
            frames=count,
            progress=partial(progress, "film"),
        )
        vtu.frames(history, folder / "run-vtu", count=count, progress=partial(progress, "frames"))


def values(result: RunResult) -> dict[str, Any]:
    """The numbers for programs."""
    choice, answer = result.choice, result.answer
    numbers: dict[str, Any] = {
        "scene": result.file,
        "quantity": choice.quantity,
        "tolerance": choice.tolerance,
        "model": choice.model,
        "reason": choice.reason,
        "value": answer.value,
        "error": answer.error,
        "met": answer.met,
        "sensitive": answer.sensitive,
        "seconds": answer.seconds,
        "runs": [for_programs(run) for run in answer.runs],
    }
    if answer.history is not None and choice.motion:
        turned = ("angle",) if answer.history.scene.clamps_turn else ()
        columns = ("time", "control", *turned, "height", "slope")
        numbers["motion"] = {name: getattr(answer.history, name).tolist() for name in columns}
    return numbers


def status(result: RunResult) -> int:
    """0 where the tolerance was met, 3 where not, 4 where refinement does not settle the value."""
    return SENSITIVE if result.answer.sensitive else 0 if result.answer.met else NOT_MET


COMMAND = Command(
    name="run",
    title=lambda result: f"{Path(result.file).stem}: {result.choice.quantity}",
    takes="from a millisecond to some seconds; with --motion some 15 seconds",
    main=main,
    summary=summary,
    tables=tables,
    drawings=drawings,
    values=values,
    films=films,
    export=export,
    status=status,
)
