"""What a diagram of skipping should look like without a run, from statics alone.

Type 2: the first snap is so late that U+S- is gone.  Its delay at alpha_c1, from the fold's normal form,
reaches alpha_c2 on a curve in rate and damping.  The leading order of the delay is long by a constant time
(`ribbonfem.delay`), so that the curve holds where delays are long against that time: slow and overdamped.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.optimize import brentq

from compare.models import MODELS
from ribbonfem import SolverError
from ribbonfem.delay import NormalForm, predict
from ribbonfem.results import Array

from .runs import Ground

_CURVE = 25


def _type_2(form: NormalForm, window: float, rates: Array, dampings: Array) -> Array:
    """Rate at which the delay equals the window between the folds, by damping; rows within the axes."""

    def late(log_rate: float, damping: float) -> float:
        return predict(form, math.exp(log_rate), damping).angle - window

    low, high = math.log(rates[0]) - 1.0, math.log(rates[-1]) + 1.0
    found = []
    for damping in np.geomspace(dampings[0], dampings[-1], _CURVE):
        if late(low, damping) < 0.0 < late(high, damping):
            found.append((math.exp(brentq(late, low, high, args=(damping,), xtol=1e-4)), float(damping)))
    return np.array(found).reshape(-1, 2)


def predictions(base: Ground, rates: Array, dampings: Array) -> Mapping[str, Array]:
    """Curves (k, 2) of rates and dampings by name; what a model does not offer is left out."""
    model: Any = MODELS[base.model]
    window = base.folds[1].angle - base.folds[0].angle
    if not hasattr(model, "normal_forms") or window <= 0.0:
        return {}
    mesh = {name: value for name, value in base.policy.items() if name in ("nodes", "clamp", "elements")}
    try:
        form = model.normal_forms(base.scene, **mesh)[0]
    except SolverError:
        return {}
    return {"type 2: the delay at alpha_c1 reaches alpha_c2": _type_2(form, window, rates, dampings)}
