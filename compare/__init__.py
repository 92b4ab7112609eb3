"""Models side by side: the chooser, diagrams, convergence, commands and their report.

compare.choose(scene, tolerance, quantity).run()   one number, by the cheapest model that will do
compare.fit(scene, measured, vary=).values         parameters of what was measured, with uncertainties
compare.convergence(model, scene, quantity, over=) orders and limits under refinement
compare.outcome_diagram, compare.skipping_diagram, compare.selection_diagram, compare.threshold
                                                   what ramps do over two numbers of a scene
compare.save(result, path), compare.load(path)     any result in a file
compare.read_scene(path)                           a scene from a TOML file
compare.warm()                                     compiles everything, in a process a core
python -m compare, or ribbonfem                    the command line
"""

from collections.abc import Callable
from typing import Any

# what scripts call, and the module of each: all of it imported only when it is asked for
_CALLS = {
    "choose": "compare.chooser.choice",
    "convergence": "compare.quantities.convergence",
    "fit": "compare.fitting.fit",
    "load": "compare.archive",
    "outcome_diagram": "compare.diagrams",
    "read_scene": "ribbonfem.output.scene_file",
    "save": "compare.archive",
    "selection_diagram": "compare.diagrams",
    "skipping_diagram": "compare.diagrams",
    "threshold": "compare.diagrams",
    "warm": "compare.compilation",
}

__all__ = [
    "choose",
    "convergence",
    "fit",
    "load",
    "outcome_diagram",
    "read_scene",
    "save",
    "selection_diagram",
    "skipping_diagram",
    "threshold",
    "warm",
]


def _public() -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    # imported here: the help of a command needs no numpy
    from ribbonfem.public_names import public

    return public(__name__, __all__, _CALLS)


def __getattr__(name: str) -> Any:
    return _public()[0](name)


def __dir__() -> list[str]:
    return _public()[1]()
