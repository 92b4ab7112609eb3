"""Facts that the discrete elastic rod declares for `compare`: its mesh option, orders, methods, unknowns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ribbonfem.model_info import ModelInfo

from .motion import ADAPTIVE, ORDERS


def _centred(options: Mapping[str, Any]) -> bool:
    return bool(options.get("clamp", "centred") == "centred")


MODEL_INFO = ModelInfo(
    name="der",
    mesh="nodes",
    least=7,
    planar=False,
    methods=ORDERS,
    adaptive=ADAPTIVE,
    order=lambda options: 2.0 if _centred(options) else 1.0,
    # the length of an edge
    size=lambda options: 1.0 / (options["nodes"] - (2 if _centred(options) else 1)),
    at_rest=lambda options: 4 * options["nodes"] - 15,
    in_motion=lambda options: 4 * options["nodes"] - 15,
)
