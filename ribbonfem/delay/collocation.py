"""A high-order integrator for initial values of few, smooth, often stiff unknowns: Radau IIA of nine points.

Radau IIA of nine points: stiffly accurate, of order 17 at a step's end and 9 inside it, so that a
solution to eleven digits takes some tens of steps whatever its stiffness.  References: E. Hairer &
G. Wanner, "Solving Ordinary Differential Equations II", section IV.5; J. Comput. Appl. Math. 111 (1999) 93.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.polynomial import legendre

from ribbonfem.results import Array, SolverError

_POINTS, _NEWTON, _STEPS = 9, 12, 2000
_CONVERGED, _ROUNDING = 1e-13, 1e-10
# of an imaginary increment, by which the derivative is exact to rounding
_IMAGINARY = 1e-30


def _basis(points: Array) -> Array:
    """Legendre polynomials to degree 9 at points of [0, 1], (m, 10)."""
    return np.asarray(legendre.legvander(2.0 * points - 1.0, _POINTS))


# the Radau points of (0, 1], the last of them 1: roots of P_9 - P_8
_NODES = 0.5 * (1.0 + np.sort(legendre.legroots([*(0.0,) * (_POINTS - 1), -1.0, 1.0])))
# Legendre coefficients of the polynomial through the step's begin and the nodes
_COEFFICIENTS = np.linalg.inv(_basis(np.array([0.0, *_NODES])))
# integrals from the begin to the nodes of the polynomial of degree 8 with given values at the nodes
_INTEGRALS = np.column_stack(
    [
        0.5 * legendre.legval(2.0 * _NODES - 1.0, legendre.legint(row, lbnd=-1.0))
        for row in np.linalg.inv(_basis(_NODES)[:, :-1]).T
    ]
)


def integrate(
    rate: Callable[[Array, Array], Array],
    begin: float,
    end: float,
    state: Array,
    tolerance: float = 1e-12,
) -> Array:
    """The state (n,) at `end` of y' = rate(t, y) from that at `begin`.

    Parameters
    ----------
    rate: of instants (m,) and states (n, m), (n, m); it is called with complex states too.
    tolerance: of the highest Legendre coefficient of a step, relative or absolute, whichever is
        larger; what its end is off by is far smaller.

    Raises
    ------
    SolverError
        If a step falls below rounding, or after 2000 of them.
    """
    time, step = begin, 0.01 * (end - begin)
    state = np.asarray(state, dtype=np.float64)
    guess = np.repeat(state[:, None], _POINTS, axis=1)
    for _ in range(_STEPS):
        values = _collocated(rate, time + step * _NODES, step, state, guess)
        if values is None:
            factor = 0.0
        else:
            shape = np.column_stack((state, values)) @ _COEFFICIENTS.T
            last = np.abs(shape[:, -1]) / (tolerance * np.maximum(1.0, np.abs(values).max(axis=1)))
            factor = 0.8 * max(1e-30, float(last.max())) ** (-1.0 / _POINTS)
        if values is None or factor < 0.8:
            step *= min(0.5, max(0.2, factor))
            if abs(step) < 1e-14 * abs(end - begin):
                break
            guess = np.repeat(state[:, None], _POINTS, axis=1)
            continue
        time, state = time + step, values[:, -1]
        if abs(end - time) <= 1e-14 * abs(end - begin):
            return state
        before, step = step, min(step * min(2.0, factor), end - time, key=abs)
        # the polynomial of the step behind, carried on
        guess = shape @ _basis(1.0 + step / before * _NODES).T
    raise SolverError(
        f"not integrated from {begin:g} to {end:g}: no step of collocation found beyond {time:g}"
    )


def _collocated(
    rate: Callable[[Array, Array], Array], times: Array, step: float, state: Array, guess: Array
) -> Array | None:
    """The states (n, points) of a step, by Newton from a guess; None if that does not converge."""
    n, y, before = len(state), guess, np.inf
    for _ in range(_NEWTON):
        jacobian = np.empty((n, n, _POINTS))
        for k in range(n):
            moved = y.astype(complex)
            moved[k] += 1j * _IMAGINARY
            jacobian[:, k] = rate(times, moved).imag / _IMAGINARY
        residual = y - state[:, None] - step * rate(times, y) @ _INTEGRALS.T
        matrix = -step * np.einsum("pq,ikq->ipkq", _INTEGRALS, jacobian).reshape(n * _POINTS, -1)
        matrix[np.diag_indices(n * _POINTS)] += 1.0
        if not (np.isfinite(matrix).all() and np.isfinite(residual).all()):
            return None
        change = np.linalg.solve(matrix, residual.ravel()).reshape(n, _POINTS)
        y = y - change
        size = float(np.max(np.abs(change) / np.maximum(1.0, np.abs(y))))
        # where a rate is a difference of large numbers the iteration ends in their rounding
        if size <= _CONVERGED or _ROUNDING >= size > 0.5 * before:
            return y
        before = size
    return None
