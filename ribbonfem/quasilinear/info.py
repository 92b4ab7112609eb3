"""What the quasi-linear beam declares of itself."""

from __future__ import annotations

from ribbonfem.model_info import ModelInfo
from ribbonfem.stepping.control import ADAPTIVE, ORDERS

MODEL_INFO = ModelInfo(
    name="quasilinear",
    mesh="elements",
    least=4,
    planar=True,
    methods=ORDERS,
    adaptive=ADAPTIVE,
    # cubic Hermite elements
    order=lambda policy: 4.0,
    size=lambda policy: 1.0 / policy["elements"],
    at_rest=lambda elements: 2 * elements - 1,
    in_motion=lambda elements: 2 * elements - 1,
)
