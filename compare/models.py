"""The four models side by side: what each declares of itself, and their compiled code, loaded once."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import ModuleType
from typing import Any

import der
from ribbonfem import Scene, elastica, kirchhoff, quasilinear
from ribbonfem.declared import Declared

MODELS: dict[str, ModuleType] = {
    "quasilinear": quasilinear,
    "elastica": elastica,
    "kirchhoff": kirchhoff,
    "der": der,
}
# what each says of itself, and the keyword of its mesh
DECLARED: dict[str, Declared] = {name: model.DECLARED for name, model in MODELS.items()}
MESH = {name: declared.mesh for name, declared in DECLARED.items()}

_warm: set[str] = set()


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """What a call returns, and the seconds that it took."""
    begin = time.perf_counter()
    value = call()
    return value, time.perf_counter() - begin


def warm_up(*names: str) -> None:
    """Load or compile the code of these models (of all by default), once a process.

    So that no timing contains it, and that it is there before worker processes would all make it.
    """
    planar = Scene(compression=0.3, shear=0.0, start="U+", rate=10.0, stop=0.01)
    for name in names or tuple(MODELS):
        if name in _warm:
            continue
        model, mesh = MODELS[name], {MESH[name]: 21 if name == "der" else 8}
        model.folds(planar, **mesh)
        if hasattr(model, "simulate"):
            model.simulate(planar, **mesh)
        _warm.add(name)
