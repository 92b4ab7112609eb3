"""Facts that the Kirchhoff rod declares for `compare`: option of the mesh, orders, methods, unknowns."""

from __future__ import annotations

from ribbonfem.model_info import ModelInfo
from ribbonfem.stepping.methods import ALL_METHODS, method_of

MODEL_INFO = ModelInfo(
    name="kirchhoff",
    mesh="elements",
    least=4,
    planar=False,
    methods={name: method_of(name).order for name in ALL_METHODS},
    adaptive=ALL_METHODS,
    # five Gauss points an element: 2 p = 10
    order=lambda options: 10.0,
    size=lambda options: 1.0 / options["elements"],
    at_rest=lambda options: 15 * options["elements"],
    # positions, rotations and forces, of the five nodes and points of an element
    in_motion=lambda options: 45 * options["elements"] - 6,
)
