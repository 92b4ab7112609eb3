"""One scene, the cheapest way to a number of it, and how far that number can be trusted."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from compare.chooser.choice import Answer, Choice, choose
from compare.face.report import Picture, Section, Table
from compare.face.scene_file import read_scene
from compare.face.style import figure, save
from compare.sweep.progress import Progress


def _draw(choice: Choice, answer: Answer, path: Path) -> str:
    """z(1/2) of the finest run against the angle, with the answer."""
    history = answer.history
    fig, axes = figure(1, width=5.0)
    if history is not None:
        axes.plot(history.angle, history.height)
    if answer.value is not None:
        axes.axvline(answer.value, color="0.5", lw=0.8)
        axes.axhline(0.0, color="0.8", lw=0.8)
    scene = choice.scene
    axes.set_title(f"dL/L {scene.compression:g}, dW/L {scene.shear:g}, {scene.start}", fontsize=9)
    axes.set(xlabel=r"$\alpha$ (rad)", ylabel="$z(1/2)/L$")
    return save(fig, path)


def _words(choice: Choice, answer: Answer) -> str:
    what = choice.quantity
    if answer.sensitive:
        found = "nothing" if answer.value is None else f"{answer.value:.6f} rad"
        return (
            f"SENSITIVE: refinement does not settle the {what}; the last run gave {found}, and runs differ "
            f"by some {answer.error:.1e} rad. No single run decides it."
        )
    if answer.value is None:
        return f"no {what}: the clamp stops before it, or the ribbon does not do it."
    kept = "within" if answer.met else "NOT within"
    return (
        f"{what} at {answer.value:.7f} rad, to {answer.error:.1e} rad: {kept} the tolerance of "
        f"{choice.tolerance:g}."
    )


def main(
    scene: Path,
    *,
    progress: Progress | None = None,
    out: Path,
    tolerance: float = 1e-3,
    quantity: str = "snap",
    motion: bool = False,
) -> Section:
    """Give a number of the scene in a TOML file, by the cheapest model that meets --tolerance (rad).

    --quantity "snap" (z(1/2) = 0), "first snap" (the mid tangent level) or "fold" (a very slow
    ramp's last). --motion asks for the motion up to the snap too. The file holds the fields of a Scene,
    and a table [ribbon].
    """
    stated = read_scene(scene)
    choice = choose(stated, tolerance, quantity, motion=motion)
    (answer,) = (choice.run() for _ in (progress or Progress())("scene", [stated]))
    rows: list[list[Any]] = [
        [run.model, ", ".join(f"{name} {value}" for name, value in run.policy.items() if name != "until")]
        + [run.value, run.seconds]
        for run in answer.runs
    ]
    pictures = []
    if answer.history is not None:
        file = _draw(choice, answer, out / "run-motion.png")
        pictures = [Picture(file, "Height at midspan against the clamp angle, of the finest run.")]
    values: dict[str, Any] = {
        "scene": str(scene),
        "quantity": quantity,
        "tolerance": tolerance,
        "model": choice.model,
        "reason": choice.reason,
        "value": answer.value,
        "error": answer.error,
        "met": answer.met,
        "sensitive": answer.sensitive,
        "seconds": answer.seconds,
        "runs": [vars(run) for run in answer.runs],
    }
    if answer.history is not None and motion:
        columns = ("time", "angle", "height", "slope")
        values["motion"] = {name: getattr(answer.history, name).tolist() for name in columns}
    return Section(
        name="run",
        title=f"{Path(scene).stem}: {quantity}",
        text=[_words(choice, answer), f"Chosen: {choice.model}. {choice.reason}."],
        tables=[
            Table(
                "Runs",
                ["model", "policy", "angle (rad)", "CPU s"],
                rows,
                ["s", "s", ".7f", ".3f"],
                f"{answer.seconds:.3f} s in all.",
            )
        ]
        if rows
        else [],
        pictures=pictures,
        values=values,
    )
