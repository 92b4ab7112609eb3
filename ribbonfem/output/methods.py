"""What importing `compare` adds to results: `plot`, `to_pandas`, `to_xarray`, tables for notebooks.

Models neither draw nor know of files, so their results are given these methods from here; each is
imported when it is called, and nothing at all before a module with results is.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any

# of each module with results the methods of each class, and where each is written
METHODS: dict[str, dict[str, dict[str, str]]] = {
    "ribbonfem.results": {
        "History": {
            "plot": "ribbonfem.output.plots:motion",
            "to_pandas": "ribbonfem.output.tables:motion_frame",
            "to_xarray": "ribbonfem.output.tables:motion_dataset",
        },
        "Branch": {
            "plot": "ribbonfem.output.plots:branch",
            "to_pandas": "ribbonfem.output.tables:branch_frame",
            "to_xarray": "ribbonfem.output.tables:branch_dataset",
        },
        "RestState": {
            "plot": "ribbonfem.output.plots:rest",
            "_repr_html_": "ribbonfem.output.plots:rest_table",
        },
    },
    "compare.quantities.convergence": {
        "Convergence": {
            "plot": "ribbonfem.output.plots:convergence",
            "to_pandas": "ribbonfem.output.tables:convergence_frame",
        }
    },
    "compare.diagrams.result": {
        "Diagram": {
            "plot": "compare.diagrams.show:plot",
            "to_pandas": "compare.diagrams.show:frame",
            "_repr_html_": "compare.diagrams.show:html",
        }
    },
}


def _method(name: str, place: str) -> Callable[..., Any]:
    """A method that imports the function that it is when it is first called."""
    module, _, function = place.partition(":")

    def method(self: Any, *given: Any, **named: Any) -> Any:
        return getattr(import_module(module), function)(self, *given, **named)

    method.__name__ = method.__qualname__ = name
    method.__doc__ = f"See `{module}.{function}`."
    return method


def _attach(module: ModuleType) -> None:
    for kind, methods in METHODS[module.__name__].items():
        for name, place in methods.items():
            setattr(getattr(module, kind), name, _method(name, place))


class _OnceLoaded(MetaPathFinder):
    """Waits for modules with results: to import them here would cost every command's --help numpy."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """The spec of a file, its module given its methods once it has run."""
        spec = PathFinder.find_spec(fullname, path) if fullname in METHODS else None
        if spec is None or spec.loader is None:
            return None
        run = spec.loader.exec_module

        def run_and_attach(module: ModuleType) -> None:
            run(module)
            # (a zip has one loader for many modules)
            if module.__name__ == fullname:
                _attach(module)

        spec.loader.exec_module = run_and_attach  # type: ignore[method-assign]
        return spec


def install() -> None:
    """Give results their methods: those that are imported now, the others as soon as they are."""
    for name in METHODS:
        if name in sys.modules:
            _attach(sys.modules[name])
    if not any(isinstance(finder, _OnceLoaded) for finder in sys.meta_path):
        sys.meta_path.insert(0, _OnceLoaded())
