"""Facts that the quasi-linear beam declares for `compare`: option of the mesh, orders, methods, unknowns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ribbonfem.model_info import ModelInfo
from ribbonfem.stepping.control import ADAPTIVE, ORDERS

from .problem import ALONE, CUBIC


def _unknowns(options: Mapping[str, Any]) -> int:
    elements = options["elements"]
    degree = options.get("degree") or (ALONE if elements == 1 else CUBIC)
    # the dofs inside, and the load
    return int(2 * (elements - 1) + (degree - CUBIC) * elements + 1)


MODEL_INFO = ModelInfo(
    name="quasilinear",
    mesh="elements",
    # of cubic elements; one is of high degree
    least=4,
    planar=True,
    methods=ORDERS,
    adaptive=ADAPTIVE,
    # cubic Hermite elements, if no other degree is asked for
    order=lambda options: 2.0 * ((options.get("degree") or CUBIC) - 1),
    size=lambda options: 1.0 / options["elements"],
    at_rest=_unknowns,
    in_motion=_unknowns,
)
