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

The next order (`predict_snap`).  Let A be the arclength, in the norm of the mass, of the states in which
all other modes are in equilibrium, and a state's shift with alpha orthogonal to N.  Then the
kinetic energy is A_T^2 / 2 up to terms of relative order A^2, and with y = a2 A and
P = c a2, in 1/s^2,

    y_TT + nu y_T = P (alpha - alpha_c) + y^2 + gamma y^3 + beta P (alpha - alpha_c) y.

On the ramp y ~ tau^-2 and T ~ tau: gamma and beta, of some -0.002 s^2, count by tau^-2.  What is left out,
y^4, the inertia of the other modes and (alpha - alpha_c)^2, counts by tau^-4.  Both follow from the
branch of equilibria with no choice of an amplitude: at y^2 = P (alpha_c - alpha) it has
omega^2 = 2 y (1 - gamma y + ...) and |dX/dalpha|_M = (c / 2 y) (1 + (gamma - beta) y + ...).

beta goes by y -> y - beta P (alpha - alpha_c) / 2, which leaves nu beta P rate / 2 on the right: the
ramp is earlier by nu beta / 2, whatever its rate.

gamma changes the time at which a given y is reached, to first order, by gamma times
-(1/2) (3/2)^(3/2) y^(1/2) - (18/35) nu ln y + a finite part + O(y^(-1/2)) as y grows: only the finite
part knows where the solution came from.  It is g(Lambda) / tau - (36/35) nu ln tau on the ramp
(`cubic_curve`; g(0) = 1.5632; where friction rules it is (gamma nu / 3) ln rate and a constant), and another
for the solution that leaves y = 0 at alpha = alpha_c (`escape_time`), which the motion on the ramp tends to
as y grows.  Along that the model itself is followed (`departure`, `escape` of the models) from a y where
the normal form holds to the snap.  The time by which the snap precedes the end of the normal form, with the
same finite part, is T0(nu): it depends on y by y^(3/2), or y where friction rules, and is extrapolated
to none (`lead`).  So

    T_s = tau f(Lambda) + gamma (g(Lambda) / tau - (36/35) nu ln tau) - nu beta / 2 - T0(nu),

tau in s inside the logarithm.  Left out are: the next terms of the normal form, gamma^2 or beta^2 tau^-3, and
what T0 shows of y^4; the ramp's going on while the ribbon is far from the fold, T0 times
P rate T_s T0^4 / 36; and the lowest mode's ringing from the clamp's start, which reaches the fold with
tau^(7/2) P rate / omega^(5/2), less its damping.  The errors of a `Delay` add their sizes, with factors that
were measured on beams and on ribbons (where friction rules the first two show their signs): the size of
a correction, and no bound.  Where it is as large as the delay (nu in the thousands, or fast ramps),
all that is left of the prediction is that the snap comes between the fold and 1.1 times the leading
order's delay.
"""

from .cubic import cubic_curve, escape_time
from .departure import Departure, departure, scene_departure
from .normal_forms import (
    NormalForm,
    frequency,
    normal_form,
    product_from_frequencies,
    quasilinear_normal_form,
    ramp_normal_forms,
)
from .prediction import Delay, predict
from .snap import Lead, lead, next_order, predict_snap
from .universal_curve import universal

__all__ = [
    "Delay",
    "Departure",
    "Lead",
    "NormalForm",
    "cubic_curve",
    "departure",
    "escape_time",
    "frequency",
    "lead",
    "next_order",
    "normal_form",
    "predict",
    "predict_snap",
    "product_from_frequencies",
    "quasilinear_normal_form",
    "ramp_normal_forms",
    "scene_departure",
    "universal",
]
