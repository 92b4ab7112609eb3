"""What a least-squares fit says of its parameters: covariance, what is not determined, what is left to go."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ribbonfem.results import Array

# A direction in which a step of the Jacobian's changes the predictions by less than this many times what the
# model itself errs by is looked at again, farther along.
_DOUBTFUL = 5.0
# It is not determined if the change is below this many times the model's error there too.
_SEEN = 2.0
# ... or below this part of the change in the direction that is determined best.
_ROUNDING = 1e-6
# how far it is looked at, in parts of the parameters
_REACHES = (0.1, 0.03, 0.01)
# part of a direction of unit length from which a parameter counts as in it
IN = 0.05


class Inference(NamedTuple):
    """In units in which the parameters are of order one.

    Attributes
    ----------
    covariance: (p, p); infinite on the diagonal of a parameter that is not determined, NaN beside it.
    undetermined: directions (p,) along which the data do not say anything.
    shift: (p,) by how much the error of the model moves the parameters.
    left: how far, in standard deviations, a last step would go; blur: how much of that the model's own error
        may be.
    noise: the root of the mean square of that error, in standard deviations.
    """

    covariance: Array
    undetermined: tuple[Array, ...]
    shift: Array
    left: float
    blur: float
    noise: float

    @property
    def known(self) -> bool:
        """Whether all is determined."""
        return not self.undetermined


def infer(
    jacobian: Array,
    residual: Array,
    error: Array,
    steps: Array,
    probe: Callable[[Array], float | None],
    free: Array,
) -> Inference:
    """What the Jacobian (n, p) of the residuals (n,), in standard deviations, says at a minimum.

    Parameters
    ----------
    error: (n,) of the model's predictions, in standard deviations.
    steps: (p,) the parts of the parameters over which it was taken.
    probe: by how much the residuals change, in all, for a step (p,) of the parameters and its opposite,
        halved; None where the model fails.
    free: (p,) bool, whether a parameter is within its bounds.
    """
    u, s, v = np.linalg.svd(jacobian, full_matrices=False)
    noise = float(np.linalg.norm(error))
    slopes, known = s.copy(), np.ones(len(s), dtype=bool)
    for k in range(len(s)):
        floor, step = _ROUNDING * s[0], 1.0 / float(np.linalg.norm(v[k] / steps))
        if s[k] * step > max(_DOUBTFUL * noise, floor * step):
            continue
        for reach in _REACHES:
            change = probe(reach * v[k])
            if change is not None:
                slopes[k] = change / reach
                known[k] = change > max(_SEEN * noise, floor * reach)
                break
        else:
            known[k] = False
    lost = tuple(v[~known])
    inverse = v[known].T / slopes[known]
    covariance = inverse @ inverse.T
    unknown = np.array([any(abs(row[j]) > IN for row in lost) for j in range(len(free))])
    covariance[unknown, :] = covariance[:, unknown] = np.nan
    covariance[unknown, unknown] = np.inf
    shift = np.abs(inverse @ (u.T @ error)[known])
    shift[unknown] = np.nan
    inside = u[:, known] if free.all() else np.linalg.qr(jacobian[:, free])[0]
    left, blur = (float(np.linalg.norm(inside.T @ each)) for each in (residual, error))
    return Inference(covariance, lost, shift, left, blur, noise / float(np.sqrt(len(error))))
