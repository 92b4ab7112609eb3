"""What the default tolerance of every model leaves of a snap's angle, beside what its default mesh does."""

import numpy as np
import pytest

import der
from ribbonfem import Ribbon, Scene, SceneError, elastica, kirchhoff, quasilinear

STEEL = Ribbon(length=0.18, width=0.012, thickness=0.0002, young=200e9, density=7850.0, poisson=0.3)
TIGHT = {"method": "esdirk4", "tolerance": 1e-7}
# the mesh beside the default one, and the factor from the change to the error of the default one
FINER = {
    der: ({"nodes": 301}, 4 / 3),
    kirchhoff: ({"elements": 12}, 1.0),
    elastica: ({"elements": 24}, 1.0),
    quasilinear: ({"elements": 64}, 1.0),
}
# rad: what defaults leave in time, in the median, in nine of ten, and at most
LEAVES = {
    der: (2e-5, 5e-5, 1e-4),
    kirchhoff: (1e-5, 6e-5, 2e-4),
    elastica: (1e-5, 4e-5, 1e-4),
    quasilinear: (1e-5, 6e-5, 1e-4),
}


def snap(model, scene, **options):
    result = model.simulate(scene, until="snap", every=10**6, **options).crossing()
    return np.nan if result is None else result[1]


def test_the_steel_strip_is_left_to_the_mesh_of_the_rods():
    scene = Scene(
        compression=0.25, shear=0.2, start="U+", rate=1.0, stop=1.5, hold=0.1, damping=0.5, ribbon=STEEL
    )
    tight = snap(der, scene, **TIGHT)
    left = abs(snap(der, scene) - tight)
    assert left < 1e-4
    # the elements' limit
    assert left < abs(tight - 0.7626554)


def drawn(planar):
    """Scenes of h/L .004 to .02, rates .03 to 5 rad/s, nu .1 to 20 1/s; seeded."""
    rng = np.random.default_rng(2025 + planar)
    while True:
        thickness, rate, damping = (
            10.0 ** rng.uniform(*np.log10(ends)) for ends in ((0.004, 0.02), (0.03, 5.0), (0.1, 20.0))
        )
        compression = rng.uniform(0.1, 0.45)
        yield Scene(
            compression=compression,
            shear=0.0 if planar else compression * rng.uniform(0.5, 0.98),
            start="U+" if planar else "U+S-",
            rate=rate,
            stop=3.0,
            damping=damping,
            ribbon=Ribbon(thickness=thickness),
        )


@pytest.mark.slow
@pytest.mark.parametrize("model", LEAVES)
def test_what_defaults_leave(model):
    finer, factor = FINER[model]
    time, space = [], []
    kinds = (True, False) if model in (der, kirchhoff) else (True,)
    for planar in kinds:
        for scene, _ in zip(drawn(planar), range(20), strict=False):
            try:
                # (which mesh a motion takes by itself may depend on its scene and tolerance)
                own = {"elements": model.MODEL_INFO.settled(scene)} if model.MODEL_INFO.settled else {}
                default, tight = snap(model, scene), snap(model, scene, **TIGHT, **own)
                fine = snap(model, scene, **TIGHT, **finer)
            except SceneError:
                # no such state at this shear
                continue
            if np.isfinite(default + tight + fine):
                time.append(abs(default - tight))
                space.append(factor * abs(fine - tight))
    median, nine, most = np.median(time), np.quantile(time, 0.9), max(time)
    print(
        f"{model.__name__}: {len(time)} scenes; time {median:.1e} (median), {nine:.1e} (nine of ten), "
        f"{most:.1e} (most); space {np.median(space):.1e} (median), {max(space):.1e} (most)"
    )
    assert len(time) > 10 * len(kinds)
    assert np.all(np.array((median, nine, most)) < LEAVES[model])
    if model is der:
        assert median < 0.5 * np.median(space)
        assert most < max(space)
