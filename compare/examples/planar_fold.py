"""Where does a planar beam snap?  Cubic elements against the closed form, and against large slopes.

For small slopes the fold is known: alpha_c = 1.78178 (dL/L)^(1/2), to fifteen digits.  The beam of small
slopes has to come to it as the fourth power of the element; the elastica does not, since its slopes
are not small, and tends to it only as dL does to 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from ribbonfem import Scene, elastica, quasilinear


@dataclass(frozen=True)
class Result:
    """Angles in rad of the fold.

    Attributes
    ----------
    compression: dL/L.
    closed_form: of the beam of small slopes, without a mesh.
    elements, angles: of the same beam by cubic elements, on each mesh.
    order: observed between the two finest meshes.
    compressions, ratios: dL/L, and the elastica's angle over the closed form's there.
    """

    compression: float
    closed_form: float
    elements: tuple[int, ...]
    angles: tuple[float, ...]
    order: float
    compressions: tuple[float, ...]
    ratios: tuple[float, ...]

    @property
    def errors(self) -> tuple[float, ...]:
        """Of the meshes, in rad."""
        return tuple(abs(angle - self.closed_form) for angle in self.angles)


def main(
    *,
    compression: float = 0.1,
    elements: tuple[int, ...] = (8, 16, 32),
    compressions: tuple[float, ...] = (0.02, 0.05, 0.1, 0.2, 0.3, 0.4),
) -> Result:
    """The fold of the planar U+ on several meshes and at several compressions."""
    # problem: no shear, and no ramp, since a fold asks for none
    scene = Scene(compression=compression, shear=0.0, start="U+")

    # discretisation: one configuration a mesh
    meshes: list[dict[str, Any]] = [{"elements": count} for count in elements]

    # solver: the fold is a root, and the closed form has no mesh at all
    mu = quasilinear.closed_form_fold().mu

    # run
    angles = tuple(quasilinear.folds(scene, **mesh)[0].angle for mesh in meshes)
    large = [elastica.folds(Scene(compression=c, shear=0.0, start="U+"))[0].angle for c in compressions]

    exact = mu * math.sqrt(compression)
    errors = [abs(angle - exact) for angle in angles[-2:]]
    return Result(
        compression=compression,
        closed_form=exact,
        elements=tuple(elements),
        angles=angles,
        order=math.log(errors[0] / errors[1]) / math.log(elements[-1] / elements[-2]),
        compressions=tuple(compressions),
        ratios=tuple(angle / (mu * math.sqrt(c)) for angle, c in zip(large, compressions, strict=True)),
    )


def look(result: Result) -> Any:
    """Errors over the mesh; and how far large slopes move the fold."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.6, 3.2), constrained_layout=True)
    left.loglog(result.elements, result.errors, "o-", label=f"cubic elements, order {result.order:.2f}")
    first = np.array(result.elements) / result.elements[0]
    left.loglog(result.elements, result.errors[0] * first**-4.0, "--", color="0.6", label="order 4")
    left.set(xlabel="elements", ylabel=r"error of $\alpha_c$ (rad)", title=f"dL/L = {result.compression:g}")
    left.set_xticks(result.elements, [str(count) for count in result.elements])
    left.minorticks_off()
    left.legend(frameon=False)
    right.axhline(1.0, color="0.6", lw=1.0)
    right.plot(result.compressions, result.ratios, "o-", color="C1")
    right.set(xlabel="dL/L", ylabel=r"$\alpha_c$ / closed form", title="the elastica, inextensible")
    return figure
