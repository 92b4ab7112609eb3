"""How late does a ramp snap?  Runs at several rates against a prediction without a run.

A ramp passes the fold and snaps later, by an angle that falls more slowly than the rate.  The normal form
of the fold says by how much, with no parameter fitted; the next order says where that ends.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import matplotlib.pyplot as plt

from ribbonfem import Scene, elastica
from ribbonfem.delay import predict, predict_snap


@dataclass(frozen=True)
class Result:
    """Delays of the angle behind the fold, rad.

    Attributes
    ----------
    fold: its angle, on the mesh of the runs.
    rates: rad/s.
    measured: from a run at each rate to z(1/2) = 0.
    leading: predicted from the fold alone.
    next_order: predicted to the next order; errors: what that may be off by.
    """

    fold: float
    rates: tuple[float, ...]
    measured: tuple[float, ...]
    leading: tuple[float, ...]
    next_order: tuple[float, ...]
    errors: tuple[float, ...]


def main(
    *,
    compression: float = 0.40,
    damping: float = 1.0,
    rates: tuple[float, ...] = (0.001, 0.01, 0.1),
    elements: int = 10,
    tolerance: float = 1e-6,
) -> Result:
    """Delays of the planar elastica."""
    # problem
    scene = Scene(compression=compression, shear=0.0, start="U+", damping=damping)

    # discretisation: the fold has to be that of the mesh which moves
    mesh: dict[str, Any] = {"elements": elements}
    (form,) = elastica.normal_forms(scene, **mesh)

    # solver: adaptive steps, ended soon after the snap; the ramp goes on for long enough to snap
    options: dict[str, Any] = {**mesh, "tolerance": tolerance, "until": "snap"}
    leading = [predict(form, rate, damping) for rate in rates]
    stops = [form.angle + 2.0 * delay.angle for delay in leading]

    # run
    ramps = [replace(scene, rate=rate, stop=stop) for rate, stop in zip(rates, stops, strict=True)]
    snaps = [elastica.simulate(ramp, **options).crossing("height") for ramp in ramps]
    better = [predict_snap(elastica, ramp, **mesh) for ramp in ramps]

    return Result(
        fold=form.angle,
        rates=tuple(rates),
        measured=tuple(snap[1] - form.angle if snap else float("nan") for snap in snaps),
        leading=tuple(delay.angle for delay in leading),
        next_order=tuple(delay.angle for delay in better),
        errors=tuple(delay.angle_error for delay in better),
    )


def look(result: Result) -> Any:
    """Delay over rate, and measured over predicted."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.6, 3.2), constrained_layout=True)
    left.loglog(result.rates, result.leading, "--", color="0.6", label="predicted, leading order")
    left.loglog(result.rates, result.next_order, "-", color="C0", label="predicted, next order")
    left.loglog(result.rates, result.measured, "o", color="C1", label="measured")
    left.set(xlabel="rate (rad/s)", ylabel="delay of the angle (rad)")
    left.legend(frameon=False)
    right.axhline(1.0, color="0.6", lw=1.0)
    for values, style in ((result.leading, "s--"), (result.next_order, "o-")):
        ratios = [m / p for m, p in zip(result.measured, values, strict=True)]
        right.semilogx(result.rates, ratios, style, color="0.6" if values is result.leading else "C0")
    right.set(xlabel="rate (rad/s)", ylabel="measured / predicted")
    return figure
