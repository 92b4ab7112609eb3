"""Parallel sweeps: tasks, the store of finished ones, worker processes, and the runner that joins them.

Imported as they are asked for: a worker has to say how many threads numpy may use before it loads numpy.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .progress import Progress
    from .runner import Sweep, SweepError
    from .task import Failure, Task

__all__ = ["Failure", "Progress", "Sweep", "SweepError", "Task"]

_PLACES = {
    "Failure": "task",
    "Progress": "progress",
    "Sweep": "runner",
    "SweepError": "runner",
    "Task": "task",
}


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
