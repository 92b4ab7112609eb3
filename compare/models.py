"""The list of the four models with their declared facts, and loading of their compiled code."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import ModuleType
from typing import Any

import der
from ribbonfem import Scene, elastica, kirchhoff, quasilinear
from ribbonfem.model_info import ModelInfo

MODELS: dict[str, ModuleType] = {
    "quasilinear": quasilinear,
    "elastica": elastica,
    "kirchhoff": kirchhoff,
    "der": der,
}
# what each says of itself, and the keyword of its mesh
MODEL_INFO: dict[str, ModelInfo] = {name: model.MODEL_INFO for name, model in MODELS.items()}
MESH = {name: declared.mesh for name, declared in MODEL_INFO.items()}

_warm: set[tuple[str, bool]] = set()


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """What a call returns, and the seconds that it took."""
    begin = time.perf_counter()
    value = call()
    return value, time.perf_counter() - begin


def warm_up(*names: str, motion: bool = True) -> None:
    """Load or compile the code of these models (of all by default), once a process.

    So that no timing contains it, and that it is there before worker processes would all make it.

    Parameters
    ----------
    names: of models.
    motion: whether that of `simulate` too.
    """
    planar = Scene(compression=0.3, shear=0.0, start="U+", rate=10.0, stop=0.01)
    for name in names or tuple(MODELS):
        mesh = {MESH[name]: 21 if name == "der" else 8}
        for what, call in ((False, MODELS[name].folds), (True, MODELS[name].simulate)):
            if what <= motion and (name, what) not in _warm:
                call(planar, **mesh)
                _warm.add((name, what))
