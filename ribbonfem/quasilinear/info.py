"""Facts that the quasi-linear beam declares for `compare`: option of the mesh, orders, methods, unknowns."""

from __future__ import annotations

from ribbonfem.model_info import ModelInfo
from ribbonfem.stepping.control import ADAPTIVE, ORDERS


def _unknowns(elements: int) -> int:
    # 15 bubbles of one element
    return 2 * elements - 1 if elements > 1 else 16


MODEL_INFO = ModelInfo(
    name="quasilinear",
    mesh="elements",
    # of cubic elements; one is of high degree
    least=4,
    planar=True,
    methods=ORDERS,
    adaptive=ADAPTIVE,
    # cubic Hermite elements, if no other degree is asked for
    order=lambda options: 2.0 * ((options.get("degree") or 3) - 1),
    size=lambda options: 1.0 / options["elements"],
    at_rest=_unknowns,
    in_motion=_unknowns,
)
