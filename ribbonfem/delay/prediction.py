"""The delay of a snap behind its fold to leading order, by the fold's normal form; the class `Delay`."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ribbonfem.options import number, refuse

from .normal_forms import NormalForm
from .universal_curve import universal


@dataclass(frozen=True)
class Delay:
    """How late a snap is.

    Attributes
    ----------
    time: s.
    angle: rad, with the sign of the rate.
    damping: Lambda, below 1 inertial and above overdamped.
    error: estimate of what the time leaves out, s; infinite where nobody made one, as in the leading order.
        Also `time_error`; `angle_error` is the same in rad.
    """

    time: float
    angle: float
    damping: float
    error: float = math.inf

    @property
    def time_error(self) -> float:
        """`error`, by the name that says its unit, s."""
        return self.error

    @property
    def angle_error(self) -> float:
        """The error of the angle, rad."""
        return self.error * abs(self.angle / self.time)


def predict(fold: NormalForm, rate: float, damping: float) -> Delay:
    """The delay of a ramp through a fold, without simulation.

    Parameters
    ----------
    fold: the normal form.
    rate: rad/s, of the sign with which the fold is met.
    damping: nu, 1/s.

    Raises
    ------
    ValueError
        If the ramp runs away from the fold, or damping is negative.

    Examples
    --------
    >>> from ribbonfem import Scene, elastica
    >>> (form,) = elastica.normal_forms(Scene(compression=0.40, shear=0.0, start="U+"))
    >>> delay = predict(form, rate=0.01, damping=1.0)
    >>> round(delay.time, 4), round(delay.angle, 6)
    (0.7706, 0.007706)
    """
    if not isinstance(fold, NormalForm):
        refuse("fold", fold, "a NormalForm is needed, as `normal_forms` of a model gives it")
    rate, damping = number("rate", rate), number("damping", damping)
    scaled = fold.product * rate
    if not scaled > 0.0:
        refuse(
            "rate",
            rate,
            f"a ramp of this sign does not meet the fold at {fold.angle:.6g} rad from its stable side",
        )
    tau = scaled**-0.2
    time = tau * universal(damping * tau)
    return Delay(time, rate * time, damping * tau)
