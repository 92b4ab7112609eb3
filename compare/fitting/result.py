"""The result of a fit, `Fit`: values with uncertainties, what is left, what the data do not determine."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import gammainccinv

from ribbonfem import Branch, History, Scene
from ribbonfem.frozen import called_later, html_table, short_options
from ribbonfem.measured import Measured
from ribbonfem.results import Array, Value

# part of the uncertainty up to which the model's own error leaves a value settled
SMALL = 0.3
# how seldom chi2 is larger where scene, model and uncertainties are right
_SELDOM = 1e-4


def _rounded(value: float, spread: float) -> str:
    """A value with its standard deviation: two digits of that, and as many places of the value."""
    if not (math.isfinite(spread) and spread > 0.0 and value):
        return f"{value:.6g} ± {spread:.2g}"
    digits = 2 + math.floor(math.log10(abs(value))) - math.floor(math.log10(spread))
    return f"{value:.{min(max(digits, 1), 15)}g} ± {spread:.2g}"


@dataclass(frozen=True, repr=False, eq=False)
class Fit(Value):
    """Parameters fitted to what was measured.

    Attributes
    ----------
    values: by the names in `vary`, in the units of `Scene` and `Ribbon`; "offset" in s.
    uncertainty: one standard deviation of each; infinite where the data do not determine it.
    correlation: (p, p), in the order of `values`; NaN where the data do not determine.
    model_error: by how much the numerical error of the model moves each value: by one refined run.
    prediction_error: what the model's predictions err by, root of the mean square, in standard deviations.
    undetermined: combinations that the data say nothing of: relative changes of parameters by name,
        together of length one.
    at_bounds: names of values that are at a bound; their uncertainty is that of a side alone.
    converged: whether the search ended in a minimum.
    chi2: the sum of squared residuals in standard deviations; degrees: data less parameters.
    estimated: names of the quantities whose standard deviation was estimated: of these chi2 says nothing.
    predicted: of each scene, by name, what would have been measured, in the units of what was; of states at
        rest, which are those nearest on the curve, "control" too.
    sigma: of each scene, by name, the standard deviations, in the same units.
    scenes: with the values; measured: what they were fitted to; begun: the values before.
    histories, curves: of each scene the motion, and the states at rest, at the values, or None.
    model, options: of the runs; runs: how many there were; seconds: of CPU, of all.
    """

    values: Mapping[str, float]
    uncertainty: Mapping[str, float]
    correlation: Array
    model_error: Mapping[str, float]
    prediction_error: float
    undetermined: tuple[Mapping[str, float], ...]
    at_bounds: tuple[str, ...]
    converged: bool
    chi2: float
    degrees: int
    estimated: tuple[str, ...]
    predicted: tuple[Mapping[str, Array], ...]
    sigma: tuple[Mapping[str, Array], ...]
    scenes: tuple[Scene, ...]
    measured: tuple[Measured, ...]
    begun: Mapping[str, float]
    histories: tuple[History | None, ...]
    curves: tuple[Branch | None, ...]
    model: str
    options: Mapping[str, Any]
    runs: int
    seconds: float

    @property
    def scene(self) -> Scene:
        """The fitted scene, the first of several."""
        return self.scenes[0]

    @property
    def history(self) -> History | None:
        """The motion of the fitted scene, the first of several."""
        return self.histories[0]

    @property
    def residual(self) -> tuple[dict[str, Array], ...]:
        """Of each scene, by name, what was measured less what is predicted, in the units of what was."""
        pairs = zip(self.measured, self.predicted, strict=True)
        return tuple({name: data.values(name) - p for name, p in each.items()} for data, each in pairs)

    @property
    def reduced_chi2(self) -> float:
        """chi2 over its degrees of freedom: about 1 where scene, model and uncertainties are right."""
        return self.chi2 / self.degrees if self.degrees else np.nan

    @property
    def identifiable(self) -> dict[str, bool]:
        """Whether the data determine each value."""
        return {name: bool(np.isfinite(spread)) for name, spread in self.uncertainty.items()}

    @property
    def met(self) -> bool:
        """Whether it converged, all is determined, the model's own error is small, and chi2 as it may be."""
        likely = not self.reduced_chi2 > self._usual
        return self.converged and not self.undetermined and not self._coarse and likely

    @property
    def _usual(self) -> float:
        """What a reduced chi2 may be; infinite where a standard deviation was made of what is left."""
        if self.estimated or not self.degrees:
            return math.inf
        return float(2.0 * gammainccinv(0.5 * self.degrees, _SELDOM) / self.degrees)

    @property
    def _noise(self) -> dict[str, str]:
        """The estimated standard deviations, each with the unit of what was measured."""
        return {
            name: f"{np.nanmax(sigma[name]):.2g} {data.unit(name, scene.drives.unit)}"
            for scene, data, sigma in zip(self.scenes, self.measured, self.sigma, strict=True)
            for name in self.estimated
            if name in sigma
        }

    @property
    def _coarse(self) -> list[str]:
        pairs = self.model_error.items()
        return [name for name, error in pairs if error > SMALL * self.uncertainty[name]]

    @property
    def texts(self) -> dict[str, str]:
        """Each value with its uncertainty, to as many digits as that allows."""
        return {name: _rounded(x, self.uncertainty[name]) for name, x in self.values.items()}

    def summary(self) -> list[str]:
        """What has to be known of it, in sentences."""
        lines = []
        if not self.converged:
            lines.append("It did not converge: begin nearer to the solution, or fit the first rows first.")
        lines += [
            f"The standard deviation of {name} was not given. {spread} is estimated from what the fit "
            "leaves, so that chi2 tests nothing: compare it with the error of the instrument."
            for name, spread in self._noise.items()
        ]
        for direction in self.undetermined:
            text = f"The data do not determine {' and '.join(direction)}"
            if len(direction) > 1:
                parts = ", ".join(f"{part:+.2g}" for part in direction.values())
                text += f": relative changes in the ratio {parts} leave what is predicted as it is"
            if self.prediction_error > 1.0:
                text += f", beside what the model errs by, {self.prediction_error:.2g} standard deviations"
            lines.append(f"{text}.")
        for name in self._coarse:
            lines.append(
                f"{name}: the model's own error, {self.model_error[name]:.1e}, is not small beside the "
                "uncertainty. A smaller tolerance lessens it, but hardly where the ribbon vibrates for long."
            )
        if self.at_bounds:
            lines.append(f"At a bound: {', '.join(self.at_bounds)}.")
        if self.reduced_chi2 > self._usual:
            lines.append(
                f"chi2 is {self.reduced_chi2:.3g} a degree of freedom, and {self._usual:.3g} at most would "
                "be usual: the search ended beside the solution (begin elsewhere), the scene is not what was "
                "measured, or the uncertainties are too small."
            )
        return lines

    def table(self) -> str:
        """The values as lines of text."""
        lines = [f"{'':>16} {'value':>13} {'+-':>9} {'model error':>11} {'begun at':>11}"]
        for name, value in self.values.items():
            lines.append(
                f"{name:>16} {value:13.7g} {self.uncertainty[name]:9.2g} {self.model_error[name]:11.1e} "
                f"{self.begun[name]:11.5g}"
            )
        return "\n".join(lines)

    @property
    def _line(self) -> str:
        known = f"chi2/{self.degrees} = {self.reduced_chi2:.3g}" if self.degrees else "as many data as values"
        noise = ", ".join(f"{name} +- {spread} estimated" for name, spread in self._noise.items())
        state = "converged" if self.converged else "NOT converged"
        options = short_options(self.options)
        return f"{state}, {noise or known}; {self.model}, {options}; {self.runs} runs, {self.seconds:.3g} s"

    def __str__(self) -> str:
        return "\n".join((self._line, self.table(), *self.summary()))

    def __repr__(self) -> str:
        pairs = (f"{name} {text}" for name, text in self.texts.items())
        return f"Fit({', '.join(pairs)}; {'converged' if self.converged else 'NOT converged'})"

    def _repr_html_(self) -> str:
        rows = [
            (name, x, self.uncertainty[name], self.model_error[name], self.begun[name])
            for name, x in self.values.items()
        ]
        caption = "\n".join((self._line, *self.summary(), self.scene.in_words))
        return html_table(caption, ("", "value", "±", "model error", "begun at"), rows)

    def plot(self, axes: Any = None, **options: Any) -> Any:
        """Draw it into axes of matplotlib, or new ones: see `ribbonfem.output.plots.fit`."""
        return called_later("ribbonfem.output.plots:fit", self, axes, **options)

    def to_pandas(self) -> Any:
        """As a `pandas.DataFrame`, a row a datum: see `ribbonfem.output.tables.fit_frame`."""
        return called_later("ribbonfem.output.tables:fit_frame", self)
