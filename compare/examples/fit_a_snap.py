"""What are modulus, damping and the camera's offset?  A snap that was filmed, and a fit to it.

A spring-steel strip of 0.2 m is compressed by a fifth and one clamp is turned; a camera with a clock of its
own reads the height of the middle to 0.2 mm.  Here the strip is made of rods, with numbers that are known and
with noise, and fitted by elements, which share no mechanics with them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import compare
import der
from ribbonfem import Ribbon, Scene
from ribbonfem.measured import Measured


@dataclass(frozen=True)
class Result:
    """A fit, and what is true.

    Attributes
    ----------
    fit: of `compare.fit`.
    truth: values by the names of the fit.
    """

    fit: Any
    truth: dict[str, float]


def main(
    *,
    young: float = 193e9,
    damping: float = 7.0,
    offset: float = 0.5,
    noise: float = 0.2,
    frames: int = 301,
    nodes: int = 201,
    seed: int = 1,
) -> Result:
    """A snap of a steel strip, filmed for 0.15 s with a noise in mm."""
    # problem: what is known of the strip, a handbook's modulus, and a guess of the damping
    steel = Ribbon(length=0.2, width=0.02, thickness=2e-4, young=200e9, density=7850.0, retardation=3e-5)
    drop = (0.0, 0.0, -9.81)
    begun = Scene(
        compression=0.2, shear=0.0, start="U+", rate=20.0, stop=1.2, damping=5.0, gravity=drop, ribbon=steel
    )
    strip = replace(begun, damping=damping, hold=0.1, ribbon=replace(steel, young=young))

    # discretisation: rods in place of the bench
    mesh: dict[str, Any] = {"nodes": nodes, "configurations": False}

    # solver: steps so fine that the rods err by a tenth of the noise; a camera that begins before the clamp
    frame = np.linspace(-0.01, 0.14, frames)
    film = der.simulate(strip, tolerance=1e-6, **mesh)
    height = 1e3 * steel.length * np.interp(frame, film.time, film.height)
    height += noise * np.random.default_rng(seed).standard_normal(frames)
    data = Measured(
        time=1e3 * (frame + offset),
        height=height,
        units={"time": "ms", "height": "mm"},
        uncertainty=noise,
    )

    # run
    fit = compare.fit(begun, data, vary={"young": None, "damping": None, "offset": (0.48, 0.52)})
    return Result(fit, {"young": young, "damping": damping, "offset": offset})


def look(result: Result) -> Any:
    """Heights that were measured and those of the fit; above, what is left, in standard deviations."""
    return result.fit.plot().figure
