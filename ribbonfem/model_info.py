"""The class `ModelInfo`: the facts that each model declares, so that `compare` need not know it."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from .frozen import Frozen


@dataclass(frozen=True)
class ModelInfo:
    """The facts of a model.

    Attributes
    ----------
    name: of the model.
    mesh: its mesh keyword, "elements" or "nodes"; `least` the fewest.
    planar: whether it takes planar scenes alone.
    methods: order in the step of each method of `simulate`.
    adaptive: those of them that have adaptive steps.
    order: of folds and snaps in the mesh, of the options.
    size: what goes to zero as the mesh is refined (L), of the options.
    at_rest, in_motion: unknowns, of the options.
    settled: the mesh of a motion, where the signature leaves it open: of a scene and, where they are not
        those of `simulate`, a tolerance (L; None of fixed steps) and `initial`.
    """

    name: str
    mesh: str
    least: int
    planar: bool
    methods: Mapping[str, int]
    adaptive: tuple[str, ...]
    order: Callable[[Mapping[str, Any]], float]
    size: Callable[[Mapping[str, Any]], float]
    at_rest: Callable[[Mapping[str, Any]], int]
    in_motion: Callable[[Mapping[str, Any]], int]
    settled: Callable[..., int] | None = None

    def __hash__(self) -> int:
        return hash((self.name, self.mesh))


def defaults(model: ModuleType, function: str) -> Frozen[str, Any]:
    """The options of a model's function with their defaults: immutable, hashable, visible.

    Raises
    ------
    AttributeError
        If the model has no such function; names those that it has.
    """
    parameters = inspect.signature(getattr(model, function)).parameters.values()
    return Frozen({p.name: p.default for p in parameters if p.kind is p.KEYWORD_ONLY})
