"""Reference snaps of scenes, finer than any choice, with a second model beside: to check answers against."""

from __future__ import annotations

import math

from compare.limits import limit_of
from ribbonfem import Scene, elastica

from .random_scenes import element_snap, rod_snap
from .refinement import endless

# elements and tolerances (L) of the reference, finer than those of any answer, and of the check of it
_ELEMENTS = ((24, 1e-8), (28, 3e-9))
# its witnesses: elements and tolerance of the elastica, meshes and tolerances of rods
_ELASTICA = (32, 1e-8)
_RODS = ((51, 101, 201), (1e-6, 1e-7))


def rod(scene: Scene, nodes: int, tolerance: float, method: str = "tr-bdf2") -> float | None:
    """The angle of the snap of a rod, rad; None where there is none."""
    result = rod_snap(scene, nodes, tolerance, method)[0]
    return None if math.isnan(result) else result


def _run(scene: Scene, elements: int, tolerance: float) -> float | None:
    result = element_snap(scene, elements, tolerance)[0]
    return None if math.isnan(result) else result


def _witness(scene: Scene) -> tuple[float | None, float]:
    """The snap by a model that shares no mechanics with the elements, and what its meshes leave."""
    if scene.planar:
        elements, tolerance = _ELASTICA
        history = elastica.simulate(
            endless(scene),
            elements=elements,
            extensible=True,
            method="esdirk4",
            tolerance=tolerance,
            until="snap",
        )
        result = history.crossing()
        return (None if result is None else result[1]), 0.0
    meshes, (loose, tight) = _RODS
    snaps = [rod(scene, nodes, tight, "esdirk4") for nodes in meshes]
    values = [value for value in (*snaps, rod(scene, meshes[0], loose, "esdirk4")) if value is not None]
    if len(values) <= len(meshes):
        return None, (math.inf if values else 0.0)
    limit, uncertainty = limit_of(values[:-1], meshes)
    return limit, uncertainty + abs(values[-1] - values[0])


def reference(scene: Scene) -> tuple[float | None, float]:
    """The snap of a scene and what it may be wrong by, finer than any choice.

    Elements of the Kirchhoff rod, at a tolerance that no answer uses, and for their error the larger of two:
    the distance to a coarser run, and to a witness, as far as that one's own error does not explain it:
    the elastica for planar scenes, rods on three meshes, extrapolated, for ribbons.
    """
    coarse, fine = (_run(scene, *options) for options in _ELEMENTS)
    witness, uncertainty = _witness(scene)
    if fine is None or coarse is None or witness is None:
        return fine, (0.0 if fine is None and coarse is None and witness is None else math.inf)
    return fine, max(abs(fine - coarse), abs(fine - witness) - uncertainty)
