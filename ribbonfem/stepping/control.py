"""Step control of the finite elements: fixed step or tolerance, limits of a step, why a run ended early.

Time is counted in the ribbon's inertial time t*, damping in 1/t*.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import MappingProxyType

from ribbonfem.ends import moving
from ribbonfem.options import OptionError, choice, local_error, positive, refuse
from ribbonfem.results import DEPARTED
from ribbonfem.scene import Scene
from ribbonfem.tableaus import Tableau

from . import kernels
from .methods import METHODS, Method, method_of

UNTIL = ("end", "snap")

# Newton stops when what it would still change in any position (L) and angle (rad) is below this;
# convergence is quadratic, so that two increments d0, d1 foretell the next, d1^3 / d0^2
NEWTON_TOLERANCE = 1e-9
# rad; no adaptive step turns a clamp further
LARGEST_TURN = 0.05
# t*; a step that has to be shorter than this means that there is no solution to be found
SMALLEST_STEP = 1e-10
# What Newton left of a position the next step makes a velocity of.  A step is not halved for its energy
# below this (t*), nor below so many times what Newton leaves (L).
_SHORTEST, _LEFT = 1e-6, 100.0

# order in the step of the methods that beams and ribbons share, all of which have adaptive steps too
ORDERS = MappingProxyType({name: method_of(name).order for name in METHODS})
ADAPTIVE = METHODS


@dataclass(frozen=True)
class Control:
    """How to step: the method, a fixed `step` (s) or a `tolerance` (L), and when to end.

    `until` is "end", "snap", soon after the height first changes sign, once it has been further from
    zero than `departed` (L).
    """

    method: Method
    step: float | None
    tolerance: float | None
    until: str
    departed: float = DEPARTED

    def in_units_of(self, length: float) -> Control:
        """The same with its lengths in a beam's own unit of height."""
        tolerance = None if self.tolerance is None else self.tolerance / length
        return replace(self, tolerance=tolerance, departed=self.departed / length)

    @classmethod
    def of(
        cls,
        method: str | Tableau,
        step: float | None,
        tolerance: float | None,
        until: str,
        spectral_radius: float | None,
        default_tolerance: float,
        untils: tuple[str, ...] = UNTIL,
        methods: tuple[str, ...] = METHODS,
    ) -> Control:
        """Check the options of a `simulate` that may end in these ways.

        Raises
        ------
        OptionError
            Naming the value; also if both `step` and `tolerance` are given.
        """
        if step is not None and tolerance is not None:
            raise OptionError(f"step = {step!r} and tolerance = {tolerance!r}: give one of them, not both")
        if step is None:
            tolerance = local_error("tolerance", default_tolerance if tolerance is None else tolerance)
        return cls(
            method_of(method, spectral_radius, methods),
            None if step is None else positive("step", step),
            tolerance,
            choice("until", until, untils),
        )

    def require_elastic(self, method: object, scene: Scene) -> None:
        """Refuse a material that damps where the method takes the mean of forces along a step."""
        if self.method.mean and scene.ribbon.retardation > 0.0:
            refuse("method", method, "takes elastic moments only, and Ribbon.retardation is not 0")


def ramp_of(
    scene: Scene,
    control: Control,
    ends: kernels.Ends | None = None,
    since: float = 0.0,
    *,
    newton: float = NEWTON_TOLERANCE,
    every: int = 1,
    barrier: float = -math.inf,
    gain: float = math.inf,
    least_growth: float = 1.0,
) -> kernels.Ramp:
    """What the controls do and the control of steps; what is named is the model's own (`kernels.Ramp`).

    A step may gain `gain`, or as large a part of the energy as the tolerance is, if that is larger.
    """
    unit = scene.ribbon.inertial_time
    ends = moving(scene) if ends is None else ends
    return kernels.Ramp(
        ends=ends,
        end=float(ends.kinks[-1]),
        damping=scene.scaled_damping,
        fixed=0.0 if control.step is None else control.step / unit,
        tolerance=control.tolerance or 0.0,
        newton=newton,
        # (strain rates of a ribbon that retards are singular behind a jump of its clamp)
        first=1e-3 if scene.ribbon.retardation == 0.0 else 1e-7,
        smallest=SMALLEST_STEP,
        snap=control.until == "snap",
        since=since,
        departed=control.departed,
        every=every,
        barrier=barrier,
        gain=gain if control.method.mean else max(gain, control.tolerance or 0.0),
        shortest=max(_SHORTEST, _LEFT * newton),
        least_growth=least_growth,
    )


def problem_of(status: int, scene: Scene, control: Control) -> str:
    """Why the time loop ended before its end."""
    if status == kernels.STUCK:
        steps = f"of step = {control.step:g} s" if control.step else f"of tolerance = {control.tolerance:g}"
        least = SMALLEST_STEP * scene.ribbon.inertial_time
        return f"{control.method.name} {steps} does not converge, with steps down to {least:.1e} s"
    if status == kernels.CREPT:
        return (
            f"{control.method.name} of step = {control.step:g} s does not converge with steps as long, and "
            "took many times as many shorter ones: give a shorter step, or a tolerance instead"
        )
    if status == kernels.GREW:
        return (
            f"the energy has grown by more than {kernels.GROWTH:.0%} without work: "
            f"{control.method.name} does not damp what it does not resolve"
        )
    return ""
