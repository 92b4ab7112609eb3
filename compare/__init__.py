"""Models side by side: one module a question, the report, and the command line (`python -m compare`)."""

from __future__ import annotations

from importlib import import_module
from typing import Any

_QUESTIONS = (
    "accuracy",
    "calibrate",
    "cases",
    "choices",
    "crosscheck",
    "delay",
    "folds",
    "run",
    "speed",
    "stability",
)
# functions that scripts call, and the module of each
_CALLS = {
    "choose": "chooser.choice",
    "convergence": "measures.convergence",
    "read_scene": "face.scene_file",
}


def __getattr__(name: str) -> Any:
    # each question pulls in the models and the plotting it needs: only when it is asked
    if name in _QUESTIONS:
        return import_module(f"{__name__}.questions.{name}")
    if name in _CALLS:
        return getattr(import_module(f"{__name__}.{_CALLS[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
