"""Facts that the elastica declares for `compare`: option of the mesh, orders, methods, unknowns."""

from __future__ import annotations

from ribbonfem.model_info import ModelInfo
from ribbonfem.stepping.methods import ALL_METHODS, method_of

from .motion import elements_for

MODEL_INFO = ModelInfo(
    name="elastica",
    mesh="elements",
    least=4,
    planar=True,
    methods={name: method_of(name).order for name in ALL_METHODS},
    adaptive=ALL_METHODS,
    # five Gauss points an element: 2 p = 10
    order=lambda options: 10.0,
    size=lambda options: 1.0 / options["elements"],
    at_rest=lambda options: 5 * options["elements"] + 1,
    # positions and forces are unknowns too
    in_motion=lambda options: 25 * options["elements"] - 3,
    settled=elements_for,
)
