"""Models side by side: one module a question, the report, and the command line (`python -m compare`)."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

_QUESTIONS = ("cases", "crosscheck", "delay", "folds", "peers", "speed", "stability")


def __getattr__(name: str) -> ModuleType:
    # each question pulls in the models and the plotting it needs: only when it is asked
    if name in _QUESTIONS:
        return import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
