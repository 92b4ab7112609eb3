"""Laws of cost and error of each model, measured once (`cost_laws.json`): what `choose` decides by.

Everything is in the beam's own units: rates and dampings times t* (`Ribbon.inertial_time`), and the
compliance c = EI2 / (EA L^2).  Errors are of the angle of the snap, z(1/2) = 0, in rad.

Planar beams (t*, dL/L and c are all there is):

* the fold and its normal form, mu = alpha_c (dL/L)^(-1/2) and c a2 t*^4 (dL/L)^(1/2), as
  Chebyshev polynomials in (dL/L)^(1/2) times powers of c;
* f(Lambda) of the normal form (`ribbonfem.delay.universal`), tabulated: its integration takes longer
  than a run;
* the delay of the snap over the normal form's prediction, on a grid of dL/L, rate and damping: the
  theory's own correction falls as rate^(1/5) and is far from negligible.  It does not
  depend on c;
* the error of the prediction made of the two.

Rods of ribbons: medians, over scenes, of the estimated errors of meshes extrapolated in N^-2, and what the
time integration errs by, over the rate.

`ribbonfem calibrate` measures them anew and compares.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline, RegularGridInterpolator

from ribbonfem import Scene
from ribbonfem.delay import NormalForm, universal

FILE = "cost_laws.json"


@dataclass(frozen=True)
class Prediction:
    """A snap without a run: its angle and what may be wrong with it (rad), and of which delay it is made."""

    angle: float
    error: float
    fold: float
    delay: float


def beam_units(scene: Scene) -> tuple[float, float, float, float]:
    """dL/L, rate t* (positive), nu t* and the compliance c of a scene."""
    compliance = 1.0 / scene.ribbon.stretch_ratio
    return scene.compression, abs(scene.scaled_rate), scene.scaled_damping, compliance


class PlanarLaws:
    """The laws of planar scenes whose ramp turns towards the fold.

    Parameters
    ----------
    data: the "planar" part of the file.
    """

    def __init__(self, data: dict[str, Any]) -> None:
        self.data = data
        self.compression: tuple[float, float] = tuple(data["compression"])
        self.compliance: float = data["compliance"]
        self.coefficients = np.array(data["fold"])
        axes = data["delay"]["axes"]
        self.axes = tuple(np.array(axes[name]) for name in ("compression", "rate", "damping"))
        self.ratio = np.array(data["delay"]["ratio"])
        self.floor, self.ringing = data["delay"]["floor"], data["delay"]["ringing"]

    @cached_property
    def _universal(self) -> CubicSpline:
        table = self.data["universal"]
        return CubicSpline(np.log(table["damping"]), np.log(table["f"]))

    def delay(self, form: NormalForm, rate: float, damping: float) -> float:
        """Angle (rad) by which the normal form alone says that a ramp snaps late, as `delay.predict`."""
        tau = (form.product * rate) ** -0.2
        lag = damping * tau
        low, *_, high = self.data["universal"]["damping"]
        f = math.exp(self._universal(math.log(lag))) if low <= lag <= high else universal(lag)
        return rate * tau * f

    @cached_property
    def _ratio(self) -> RegularGridInterpolator:
        compression, rate, damping = self.axes
        return RegularGridInterpolator(
            (np.log(compression), np.log(rate), np.log(damping)), self.ratio, method="cubic"
        )

    def outside(self, scene: Scene) -> str:
        """Which number of the scene lies outside of what was measured; empty if none does."""
        compression, rate, damping, compliance = beam_units(scene)
        for name, value, (low, high) in (
            ("dL/L", compression, self.compression),
            ("rate t*", rate, (self.axes[1][0], self.axes[1][-1])),
            ("nu t*", damping, (self.axes[2][0], self.axes[2][-1])),
            ("EI2 / (EA L^2)", compliance, (0.0, self.compliance)),
        ):
            if not low <= value <= high:
                return f"{name} = {value:.3g} lies outside of {low:.3g} .. {high:.3g}"
        return ""

    def fold(self, scene: Scene) -> NormalForm:
        """The fold on the side of U+ and its normal form, of the extensible beam, for a positive rate."""
        compression, _, _, compliance = beam_units(scene)
        low, high = (value**0.5 for value in self.compression)
        root = compression**0.5
        x = (2.0 * root - low - high) / (high - low)
        count, powers, _ = self.coefficients.shape
        basis = np.cos(np.arange(count) * math.acos(min(1.0, max(-1.0, x))))
        mu, product = np.einsum(
            "n,p,npq->q", basis, (compliance / self.compliance) ** np.arange(powers), self.coefficients
        )
        unit = scene.ribbon.inertial_time
        return NormalForm(float(mu) * root, float(product) / root / unit**4)

    def ringing_left(self, scene: Scene, fold: float) -> float:
        """The part of the ringing since the ramp began with which a beam meets its fold, in any phase."""
        _, rate, damping, _ = beam_units(scene)
        return math.exp(-0.5 * damping * fold / rate)

    def predict(self, scene: Scene) -> Prediction:
        """The snap of U+ under a positive rate, without a run (inside of what was measured)."""
        compression, rate, damping, _ = beam_units(scene)
        form = self.fold(scene)
        delay = self.delay(form, abs(scene.rate), scene.damping)
        ratio = float(self._ratio((math.log(compression), math.log(rate), math.log(damping))))
        left = self.ringing_left(scene, form.angle)
        error = self.floor + self.ringing[0] * rate ** self.ringing[1] * left + self.ringing[2] * rate
        return Prediction(form.angle + ratio * delay, error, form.angle, ratio * delay)


class RibbonLaws:
    """The laws of the discrete rods on ribbons.

    Parameters
    ----------
    data: the "ribbon" part of the file.
    """

    def __init__(self, data: dict[str, Any]) -> None:
        self.data = data
        self.meshes: tuple[int, ...] = tuple(data["meshes"])
        # error of the time integration over rate t*, by tolerance
        self.time: dict[str, float] = data["time"]

    def tolerance(self, scene: Scene, wanted: float) -> tuple[float, float]:
        """The tolerance of a run (L) whose error in time stays below a third of `wanted`, and that error."""
        rate = beam_units(scene)[1]
        # extrapolation in the mesh doubles what the quantile leaves out or lets in
        bounds = {float(key): 1e-6 + 2.0 * law * rate for key, law in self.time.items()}
        for tolerance in sorted(bounds, reverse=True):
            if bounds[tolerance] <= wanted / 3.0:
                return tolerance, bounds[tolerance]
        return min(bounds), bounds[min(bounds)]

    def mesh_error(self, start: str, level: int) -> float:
        """Estimated error that half of the scenes stay below with the meshes up to number `level`."""
        kind = "U+S+" if start in ("U+S+", "U-S-") else "U+S-"
        return float(self.data["mesh"][kind][level - 1])

    @staticmethod
    def beginning(level: int) -> slice:
        """The meshes to begin with so that number `level` is the finest: the three that are extrapolated."""
        return slice(max(0, level - 2), level + 1)

    def seconds(self, level: int) -> float:
        """Median CPU seconds of the runs on the meshes to begin with."""
        return float(sum(self.data["seconds"][self.beginning(level)]))


@dataclass(frozen=True)
class Laws:
    """All that was measured; `data` as in the file."""

    data: dict[str, Any]

    @cached_property
    def planar(self) -> PlanarLaws:
        """Those of planar scenes."""
        return PlanarLaws(self.data["planar"])

    @cached_property
    def ribbon(self) -> RibbonLaws:
        """Those of sheared ones."""
        return RibbonLaws(self.data["ribbon"])


@lru_cache(maxsize=1)
def shipped() -> Laws:
    """The laws that come with the package."""
    return Laws(json.loads(resources.files("compare.chooser").joinpath(FILE).read_text(encoding="utf-8")))


def rounded(values: ArrayLike, digits: int) -> Any:
    """A number, or an array as nested lists of numbers, with a few significant digits."""
    return np.vectorize(lambda v: float(f"{v:.{digits}g}"))(values).tolist()
