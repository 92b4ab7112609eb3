"""How late a ramp snaps: the normal form at a fold, and its universal curve (paper, section 4.4).

Near a fold at alpha_c the amplitude A of the mass-normalised null vector obeys

    A_TT + nu A_T = c (alpha - alpha_c) + a2 A^2,

whatever the model.  With alpha - alpha_c = rate T and tau = (c a2 rate)^(-1/5), A = a / (a2 tau^2),
T = tau t, it has one parameter, Lambda = nu tau:

    a'' + Lambda a' = t + a^2,   a ~ -sqrt(-t) as t -> -infinity.

a grows without bound at t = f(Lambda), so that the snap comes T_s = tau f(Lambda) after the
fold and the angle is late by rate T_s, with no parameter fitted.  f(0) = 3.4117 (the tritronquee
of Painleve I) and f -> 2.33811 Lambda^(2/3), the first zero of Airy's function.

The product c a2 is of the static fold alone: of its null vector (`normal_form`) or of the slope
of omega^4 along the stable branch (`product_from_frequencies`).  References: P. Mandel & T. Erneux,
SIAM J. Appl. Math. 47 (1987) 1; M. Liu, M. Gomez & D. Vella, J. Mech. Phys. Solids 147 (2021) 104116.
"""

from .curve import universal
from .departure import Departure, departure, scene_departure
from .next_order import cubic_curve, escape_time
from .normal_form import (
    NormalForm,
    frequency,
    normal_form,
    product_from_frequencies,
    quasilinear_normal_form,
    ramp_normal_forms,
)
from .prediction import Delay, predict

__all__ = [
    "Delay",
    "Departure",
    "NormalForm",
    "cubic_curve",
    "departure",
    "escape_time",
    "frequency",
    "normal_form",
    "predict",
    "product_from_frequencies",
    "quasilinear_normal_form",
    "ramp_normal_forms",
    "scene_departure",
    "universal",
]
