"""References beside integrators that share no step with them."""

from __future__ import annotations

from dataclasses import dataclass

from .hard_cases import ELASTICA, QUASILINEAR, RODS


@dataclass(frozen=True)
class Confirmation:
    """A reference beside another integrator on the same mesh with small fixed steps.

    Attributes
    ----------
    wanted, found: instant of the snap by the reference and by the other integrator, s.
    error, unit, allowed: the difference, and the most that a default run may be off.
    """

    case: str
    model: str
    method: str
    step: float
    wanted: float | None = None
    found: float | None = None
    error: float | None = None
    unit: str = ""
    allowed: float | None = None
    note: str = ""


# integrators that share no step with the references, at steps where they have converged
CONFIRMED = (
    Confirmation("free ringing", RODS, "discrete-gradient", 2e-4),
    Confirmation("rate 100", RODS, "verlet", 5e-6),
    Confirmation("alpha to 3.5", RODS, "generalised-alpha", 2e-4),
    Confirmation("silicon, 0.3 mm", RODS, "discrete-gradient", 2e-9),
    Confirmation("EI1/EI2 1e4", RODS, "discrete-gradient", 2e-4),
    Confirmation("planar ringing", ELASTICA, "newmark", 1e-4),
    Confirmation("planar, rate 1000", QUASILINEAR, "generalised-alpha", 1e-5),
)
