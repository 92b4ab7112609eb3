"""The numbers of a scene by name (its own, its ribbon's, presets), and the scene with others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from .drive import CONTROLS
from .ribbon import silently
from .scene import Scene

OF_SCENE = ("compression", "shear", "rate", "stop", "hold", "damping")
OF_RIBBON = (
    *("length", "width", "thickness", "young", "density", "poisson"),
    *("bending_ratio", "twist_ratio", "curvature", "twist", "retardation"),
)


def presets_of(scene: Scene) -> tuple[str, ...]:
    """The controls that may stand somewhere, by names that are no other number's."""
    return tuple(name for name in CONTROLS if name not in (*OF_SCENE, *scene.drives.moved))


def with_numbers(scene: Scene, numbers: Mapping[str, float]) -> Scene:
    """The scene with some of its numbers changed, without the warnings that it was made with.

    Names may have their owner before them: "ribbon.young", "preset.lift".

    Raises
    ------
    SceneError
        For values that cannot be.
    """
    changed: dict[str, dict[str, Any]] = {"scene": {}, "ribbon": {}, "preset": {}}
    for name, value in numbers.items():
        owner, _, key = name.rpartition(".")
        own = "scene" if key in OF_SCENE else "ribbon" if key in OF_RIBBON else "preset"
        changed[owner or own][key] = float(value)
    fields = changed["scene"]
    if changed["preset"]:
        fields["preset"] = {**scene.preset, **changed["preset"]}
    with silently():
        if changed["ribbon"]:
            fields["ribbon"] = replace(scene.ribbon, **changed["ribbon"])
        return replace(scene, **fields) if fields else scene
