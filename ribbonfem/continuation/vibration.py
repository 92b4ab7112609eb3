"""Angular frequencies of small undamped motions about an equilibrium: a generalised eigenvalue problem."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from ribbonfem.options import OptionError, whole_number
from ribbonfem.results import Array, SolverError

from .corrector import Problem, State


class InertialProblem(Problem[State], Protocol):
    """Equilibrium equations of a body with mass."""

    @property
    def unit(self) -> float:
        """The time, in s, that the mass is counted in."""
        ...

    def momentum(self, state: State, velocity: Array, control_rate: float = 0.0) -> Array:
        """M v of the unknowns' rates `velocity` (n,) while the control changes at `control_rate`.

        Zero for multipliers and what else has no mass.
        """
        ...


def lowest_squares(
    solve: Callable[[Array], Array],
    momentum: Callable[[Array], Array],
    size: int,
    count: int,
    shift: float = 0.0,
) -> Array:
    """The lowest `count` omega^2 (count,) of K x = omega^2 M x, ascending, about a stable equilibrium.

    By the Lanczos iteration of ARPACK on (K + shift M)^-1 M (T. Ericsson & A. Ruhe, Math. Comput. 35
    (1980) 1251): what has no mass follows at once.

    Parameters
    ----------
    solve: x -> (K + shift M)^-1 x, for x (size,).
    momentum: x -> M x.

    Raises
    ------
    OptionError
        If `count` is no whole number, or too large for so many unknowns.
    SolverError
        If the iteration does not converge.
    """
    wanted = whole_number("count", count, 1)
    # a Lanczos space needs room beside the vectors sought
    room = max(2 * wanted + 2, 20)
    if room > size // 2:
        raise OptionError(f"count = {count!r}: at most {size // 4 - 1} on this mesh; use a finer one")
    mass = LinearOperator((size, size), matvec=lambda x: momentum(x.ravel()), dtype=np.float64)
    inverse = LinearOperator((size, size), matvec=lambda x: solve(x.ravel()), dtype=np.float64)
    # a start in the range of the iteration, so that nothing without mass comes in
    first = solve(momentum(np.cos(1.0 + np.arange(size) ** 1.5)))
    try:
        # (of its first argument this mode needs the shape alone)
        squares = eigsh(
            mass,
            k=wanted,
            M=mass,
            sigma=-shift,
            OPinv=inverse,
            v0=first,
            ncv=room,
            return_eigenvectors=False,
        )
    except ArpackError as error:
        raise SolverError(f"count = {count}: the frequencies did not converge: {error}") from error
    return np.sort(squares)


def natural_frequencies(problem: InertialProblem[State], state: State, parameter: float, count: int) -> Array:
    """The lowest `count` angular frequencies (count,), 1/s, of a problem whose unknowns are all that moves.

    Undamped, ascending; errors as in `lowest_squares`, and a SolverError if the equilibrium is not stable.
    """
    line = problem.linearise(state, parameter)
    if line.index:
        raise SolverError(
            f"the equilibrium at {parameter:.6g} is not stable: {line.index} unstable directions"
        )
    squares = lowest_squares(line.solve, lambda x: problem.momentum(state, x), len(problem.weight), count)
    return np.asarray(np.sqrt(squares) / problem.unit)
