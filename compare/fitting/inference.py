"""What a least-squares fit says of its parameters: covariance, what is not determined, what is left to go."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ribbonfem.results import Array

# A direction is determined if a step of the Jacobian's changes the predictions by more than this many times
# what they scatter by ...
_SEEN = 2.0
# ... and by more than this part of the change in the direction that is determined best; steps that are clear
# change them by this many times the scatter.
_ROUNDING, _CLEAR = 1e-6, 5.0
# part of a direction of unit length from which a parameter counts as in it
IN = 0.05


class Inference(NamedTuple):
    """In parts of the parameters.

    Attributes
    ----------
    covariance: (p, p); infinite on the diagonal of a parameter that is not determined, NaN beside it.
    undetermined: directions (p,) along which the data do not say anything.
    shift: (p,) by how much the error of the model moves the parameters.
    left: how far, in standard deviations, a last step would go; blur: how much of that the model's own error
        may be.
    noise: the root of the mean square of that error, in standard deviations.
    scatter: of the predictions, all told, in standard deviations.
    wanted: the part of the parameters over which the Jacobian would be clear of scatter in all directions.
    """

    covariance: Array
    undetermined: tuple[Array, ...]
    shift: Array
    left: float
    blur: float
    noise: float
    scatter: float
    wanted: float

    @property
    def coarse(self) -> float:
        """How large the shift is beside the standard deviations; of what is not determined the scatter is."""
        least = self.scatter if self.undetermined else 0.0
        return float(np.nanmax(self.shift / np.sqrt(np.diag(self.covariance)), initial=least))


def infer(
    jacobian: Array,
    residual: Array,
    error: Array,
    scatter: float,
    steps: Array,
    free: Array,
) -> Inference:
    """What the Jacobian (n, p) of the residuals (n,), in standard deviations a part, says at a minimum.

    Parameters
    ----------
    error: (n,) of the model's predictions, in standard deviations.
    scatter: by how much, all told, predictions of one scene differ that should not, in standard deviations.
    steps: (p,) the parts of the parameters over which it was taken.
    free: (p,) bool, whether a parameter may go on: not where it is pushed against a bound.
    """
    u, s, v = np.linalg.svd(jacobian, full_matrices=False)
    change = s / np.linalg.norm(v / steps, axis=1)
    real = s > _ROUNDING * s[0]
    known = real & (change > _SEEN * scatter)
    wanted = float(_CLEAR * scatter / s[real].min()) if real.any() else 0.0
    lost = tuple(v[~known])
    inverse = v[known].T / s[known]
    covariance = inverse @ inverse.T
    unknown = np.array([any(abs(row[j]) > IN for row in lost) for j in range(len(free))])
    covariance[unknown, :] = covariance[:, unknown] = np.nan
    covariance[unknown, unknown] = np.inf
    shift = np.abs(inverse @ (u.T @ error)[known])
    shift[unknown] = np.nan
    inside = u[:, known] if free.all() else np.linalg.qr(jacobian[:, free])[0]
    left, blur = (float(np.linalg.norm(inside.T @ each)) for each in (residual, error))
    noise = float(np.sqrt(np.mean(error**2)))
    return Inference(covariance, lost, shift, left, blur, noise, scatter, wanted)
