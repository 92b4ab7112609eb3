"""The paper's settings of the diagrams over rate and damping (Figs. 11 and 14), and their two commands.

The commands are here for the settings; with a scene file they are of any rig, of which nothing is known here:
its fields are handed to `compare.diagrams`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from compare.diagrams import Diagram, report
from compare.diagrams.report import Diagrams
from compare.diagrams.show import Named
from compare.report.registry import Command
from compare.sweep import Sweep
from ribbonfem import SceneError
from ribbonfem.options import OptionError
from ribbonfem.output.scene_file import read_scene


def _named(figure: str, panels: str, dampings: tuple[float, float], *outcomes: str) -> tuple[Named, ...]:
    """Runs of two panels, each at 0.01 and at 1 rad/s."""
    at = [(rate, nu, panel) for nu, panel in zip(dampings, panels, strict=True) for rate in (0.01, 1.0)]
    return tuple(
        Named(rate, nu, outcome, f"{figure}{panel}")
        for (rate, nu, panel), outcome in zip(at, outcomes, strict=True)
    )


_SHEAR = 0.40
SKIPPING = tuple((compression, _SHEAR) for compression in (0.40, 0.39, 0.38, 0.37, 0.36, 0.35))
NAMED_SKIPPING = {
    0.40: _named("Fig. 10", "AB", (0.1, 10.0), "no skip", "type 2", "no skip", "type 2"),
    0.35: _named("Fig. 10", "CD", (0.3, 30.0), "type 1", "type 2", "no skip", "type 2"),
}
SELECTION = ((0.40, 0.40, 0.36), (0.35, 0.40, 0.27))
NAMED_SELECTION = {
    0.40: _named("Fig. 12", "AB", (0.1, 10.0), "U+S-", "U-S+", "U+S-", "U+S-"),
    0.35: _named("Fig. 13", "AB", (0.3, 30.0), "U-S+", "U-S+", "U+S-", "U+S-"),
}


def rig_of(path: Path, stops: bool, asked: Mapping[str, bool]) -> tuple[tuple[float, ...], dict[str, Any]]:
    """Compression, shear (and stop), and the keywords of a diagram, of a scene file.

    Its rate and damping, which the axes say, are left aside, its hold, and its stop where the ramp goes on.

    Parameters
    ----------
    path: of the file.
    stops: whether the ramp does.
    asked: options to which a file leaves nothing, by name, and whether they were given.

    Raises
    ------
    SceneError, OptionError
        For a file of a schedule or a negative rate, or without a `stop` that is needed; for such an option.
    """
    scene = read_scene(path)
    for name, given in asked.items():
        if given:
            raise OptionError(f"--{name}: --scene {path} says what the diagram is of; give one of the two")
    if scene.schedule is not None:
        raise SceneError(f"{path}: Scene.schedule: the rates of a diagram are constant; leave it out")
    if scene.rate < 0.0:
        raise SceneError(
            f"{path}: Scene.rate = {scene.rate!r}: say by the drive which way it goes, as left = -1"
        )
    if stops and scene.stop is None:
        raise SceneError(f"{path}: Scene.stop: selection needs where the control stops")
    place = (scene.compression, scene.shear, *((scene.stop,) if stops and scene.stop is not None else ()))
    return place, {name: getattr(scene, name) for name in ("start", "drive", "preset", "gravity", "ribbon")}


def compute(
    make: Callable[..., Diagram],
    places: Sequence[tuple[float, ...]],
    axes: Sequence[tuple[float, float, int]],
    *,
    seed: int,
    sweep: Sweep | None,
    scene: Path | None,
    asked: Mapping[str, bool],
    **options: Any,
) -> Diagrams:
    """A diagram over rate and damping, `axes`, of each of these dL, dW (and stop), or of a scene file.

    `asked`: see `rig_of`.
    """
    rig: dict[str, Any] = {}
    if scene is not None:
        place, rig = rig_of(scene, len(places[0]) > 2, asked)
        places = (place,)
    calls = [partial(make, *place, *axes, seed=seed, **rig) for place in places]
    return report.compute(calls, sweep=sweep or Sweep(), **options)


def command(name: str, main: Callable[..., Diagrams], takes: str) -> Command:
    """The command of this name, "skipping" or "selection"."""
    cases: Mapping[float, Sequence[Named]] = NAMED_SELECTION if name == "selection" else NAMED_SKIPPING

    def named(result: Diagrams) -> Mapping[float, Sequence[Named]]:
        """The paper's runs, where these are diagrams of its rig."""
        scenes = [diagram.scene for diagram in result.diagrams]
        paper = all(s.usual and (s.drive, s.start, s.shear) == ("left", "U+S+", _SHEAR) for s in scenes)
        return cases if paper else {}

    return Command(
        name=name,
        title=f"Mode {name} over rate and damping",
        takes=takes,
        main=main,
        summary=report.summary,
        tables=lambda result: report.tables(result, named(result)),
        drawings=lambda result: report.drawings(result, named(result), name),
        values=report.values,
        files=lambda result: report.files(result, name),
        keep=True,
    )
