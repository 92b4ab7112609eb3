"""Time integration methods of the finite elements as data: Newmark, generalised-alpha, Runge-Kutta."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from ribbonfem import tableaus
from ribbonfem.options import OptionError, choice, positive
from ribbonfem.scene import shown
from ribbonfem.tableaus import Tableau

from . import kernels

METHODS = (*tableaus.TABLEAUS, "generalised-alpha", "newmark")
# those of the elastica and the Kirchhoff rod, which have the means of their forces along a step
ALL_METHODS = (*METHODS, "discrete-gradient")


@dataclass(frozen=True)
class Method:
    """A one-step method, with `order` in the step.

    One-stage methods are of the form r1 = r + h v + h^2 (r0 A + r1 A1), v1 = v + h (v0 A + v1 A1)
    with (1 - alpha_m) A1 + alpha_m A = (1 - alpha_f) a1 + alpha_f a, A the auxiliary
    acceleration; `error` (two factors of h^2 A, h^2 A1) is the leading local error of r.  Others
    have a `tableau`.  `mean`: a1 is that of the mean forces of the step, not of its end.
    """

    name: str
    order: int
    positions: tuple[float, float] = (0.0, 0.0)
    velocities: tuple[float, float] = (0.0, 0.0)
    alpha_m: float = 0.0
    alpha_f: float = 0.0
    error: tuple[float, float] = (0.0, 0.0)
    project: bool = False
    mean: bool = False
    tableau: Tableau | None = None

    def as_scheme(self) -> kernels.Scheme:
        """The same for the kernel."""
        if self.tableau is not None:
            # (of a value arrays are read-only, which to compiled code is another type)
            data = self.tableau
            power = data.embedded + 1.0
            return kernels.Scheme(
                kernels.DIRK,
                power,
                data.stages,
                data.a.copy(),
                data.c,
                data.error.copy(),
                *(8 * (0.0,)),
                False,
            )
        return kernels.Scheme(
            kernels.MEAN if self.mean else kernels.ONE_STAGE,
            self.order + 1.0,
            2,
            np.diag((0.0, float(self.mean))),
            np.array([0.0, 1.0]),
            np.zeros(2),
            *self.positions,
            *self.velocities,
            self.alpha_m,
            self.alpha_f,
            *self.error,
            self.project,
        )


def newmark(beta: float = 0.25, gamma: float = 0.5) -> Method:
    """Newmark's method; the default is the trapezoidal rule.

    The local error is h^3 r''' (beta - 1/6) to leading order, estimated by the difference of
    accelerations (O. C. Zienkiewicz & Y. M. Xie, Earthq. Eng. Struct. Dyn. 20 (1991) 871).
    """
    constant = beta - 1.0 / 6.0
    order = 2 if gamma == 0.5 else 1
    return Method(
        "newmark", order, (0.5 - beta, beta), (1.0 - gamma, gamma), error=(-constant, constant), project=True
    )


def discrete_gradient() -> Method:
    """The midpoint rule with the mean of the forces along the step, which balances the energy at any step.

    Average vector field, G. R. W. Quispel & D. I. McLaren, J. Phys. A 41 (2008) 045206.  Its error is
    estimated by means of velocities (`average_vector_field` of the models): accelerations ring.
    """
    return Method("discrete-gradient", 2, (0.0, 0.5), (0.0, 1.0), mean=True)


def generalised_alpha(spectral_radius: float = 0.8) -> Method:
    """Generalised-alpha for constrained systems, with this spectral radius at infinite frequency.

    J. Chung & G. M. Hulbert, J. Appl. Mech. 60 (1993) 371, in the form of M. Arnold & O. Bruls,
    Multibody Syst. Dyn. 18 (2007) 185: equilibrium holds at the ends of steps, which keeps
    order 2 also for the multipliers.  The auxiliary acceleration is that of the instant
    (alpha_m - alpha_f) h later, which the error's constant takes into account.
    """
    rho = positive("spectral_radius", spectral_radius)
    if rho > 1.0:
        raise OptionError(f"spectral_radius = {rho!r}: must be in (0, 1]")
    alpha_m, alpha_f = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
    shift = alpha_m - alpha_f
    gamma, beta = 0.5 - shift, 0.25 * (1.0 - shift) ** 2
    constant = beta + 0.5 * shift - 1.0 / 6.0
    return Method(
        "generalised-alpha",
        2,
        (0.5 - beta, beta),
        (1.0 - gamma, gamma),
        alpha_m,
        alpha_f,
        (-constant, constant),
    )


def method_of(
    method: str | Tableau, spectral_radius: float | None = None, methods: tuple[str, ...] = ALL_METHODS
) -> Method:
    """The method of a name or a tableau; `spectral_radius` belongs to "generalised-alpha" alone."""
    name = "" if isinstance(method, Tableau) else choice("method", method, methods)
    if name == "generalised-alpha":
        return generalised_alpha() if spectral_radius is None else generalised_alpha(spectral_radius)
    if spectral_radius is not None:
        raise OptionError(
            f"spectral_radius = {shown(spectral_radius)}: only for method = 'generalised-alpha', not "
            f"{shown(method)}"
        )
    if name == "newmark":
        return newmark()
    if name == "discrete-gradient":
        return discrete_gradient()
    tableau = method if isinstance(method, Tableau) else _tableau(name)
    return Method(tableau.name, tableau.constrained, tableau=tableau)


@cache
def _tableau(name: str) -> Tableau:
    """One of `tableaus`, whose conditions are checked once."""
    return tableaus.TABLEAUS[name]()
