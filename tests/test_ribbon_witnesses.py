"""Ribbons in motion by two models that share no mechanics: random scenes, refined until they agree."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest

import der
from ribbonfem import Ribbon, Scene, SceneError, SolverError, kirchhoff

SEED = 20261127
# the uncertainty with which a limit of rods is still a reference, rad
DOUBT = 1e-5


def drawn(count):
    """Scenes whose start state exists, from SEED."""
    rng = np.random.default_rng(SEED)
    scenes = []
    while len(scenes) < count:
        rate = float(10 ** rng.uniform(np.log10(0.05), np.log10(5.0)))
        compression = float(rng.uniform(0.28, 0.48))
        path, side = str(rng.choice(["S+", "S-"])), float(rng.choice([-1.0, 1.0]))
        ribbon = Ribbon(
            thickness=float(10 ** rng.uniform(np.log10(0.004), np.log10(0.02))),
            width=float(rng.uniform(0.1, 0.4)),
        )
        scene = Scene(
            compression=compression,
            shear=float(rng.choice([-1.0, 1.0]) * rng.uniform(0.9, 1.05) * (compression + 0.01)),
            # under a falling angle the mirror image of a state takes the same way
            start=("U+" if side > 0 else "U-") + path,
            rate=side * rate,
            damping=float(rng.uniform(0.0, 10.0)),
            ribbon=ribbon,
        )
        try:
            folds = kirchhoff.folds(scene, elements=8)
        except (SceneError, SolverError):
            continue
        if folds:
            # far enough for fast and overdamped ramps
            stop = side * min(2.5, abs(folds[-1].angle) + 0.3 + 0.4 * rate**0.8)
            scenes.append(replace(scene, stop=stop))
    return scenes


@dataclass(frozen=True)
class Limit:
    """A snap's angle and its uncertainty, both in rad."""

    value: float
    uncertainty: float


def snaps(history):
    """Angles of the changes of sign of t_z(1/2) (from S+) and of z(1/2); NaN where there is none."""
    result = [history.crossing("height")]
    if history.scene.start.endswith("S+"):
        result.insert(0, history.crossing("slope"))
    return np.array([np.nan if value is None else value[1] for value in result])


def rods_limit(scene):
    """Richardson's limit of N = 101, 201, 401, with the difference of the last two as uncertainty."""
    runs = [
        snaps(der.simulate(scene, nodes=n, tolerance=1e-7, configurations=False, until="snap"))
        for n in (101, 201, 401)
    ]
    first, second = (b + (b - a) / 3 for a, b in pairwise(runs))
    return [Limit(v, d) for v, d in zip(second, abs(second - first), strict=True)]


def elements_limit(scene):
    """12 elements at a tight tolerance; uncertain by what a looser one, or 8 elements, change."""

    def result(elements, tolerance):
        options = {"extensible": True, "configurations": False, "until": "snap"}
        return snaps(kirchhoff.simulate(scene, elements=elements, tolerance=tolerance, **options))

    fine = result(12, 1e-7)
    uncertainties = np.maximum(abs(fine - result(12, 3e-7)), abs(fine - result(8, 1e-7)))
    return [Limit(v, d) for v, d in zip(fine, uncertainties, strict=True)]


@pytest.mark.slow
@pytest.mark.parametrize("index", range(20))
def test_elements_and_rods_have_one_limit(index):
    """A limit that both know to 1e-5 is met to 2e-5; others within the sum of both uncertainties."""
    scene = drawn(20)[index]
    for rods, elements in zip(rods_limit(scene), elements_limit(scene), strict=True):
        print(f"{index}: rods {rods.value:.7f} +- {rods.uncertainty:.0e}", end=", ")
        print(f"elements {elements.value:.7f} +- {elements.uncertainty:.0e}")
        assert np.isnan(rods.value) == np.isnan(elements.value), scene
        if not np.isnan(rods.value):
            settled = max(rods.uncertainty, elements.uncertainty) < DOUBT
            allowed = 2e-5 if settled else rods.uncertainty + elements.uncertainty
            assert abs(rods.value - elements.value) <= allowed, scene


@pytest.mark.slow
@pytest.mark.parametrize("extensible", [False, True])
@pytest.mark.parametrize("index", range(20))
def test_the_default_mesh_is_near_the_limit_of_its_own(index, extensible):
    """At 1e-6, within 1e-5 rad of finer meshes; snaps about which those are less certain are listed apart."""
    scene = drawn(20)[index]

    def result(tolerance, **mesh):
        options = {"extensible": extensible, "configurations": False, "until": "snap"}
        return snaps(kirchhoff.simulate(scene, tolerance=tolerance, **mesh, **options))

    fine = np.array([result(1e-8, elements=elements) for elements in (16, 20, 24, 32)])
    uncertainties = np.ptp(fine, axis=0)
    off = abs(result(1e-6) - np.median(fine, axis=0))
    for error, uncertainty in zip(off, uncertainties, strict=True):
        apart = "" if uncertainty < DOUBT else " (apart)"
        print(f"{index}: {error:.1e}, finer meshes {uncertainty:.0e} apart{apart}")
    settled = uncertainties < DOUBT
    assert np.all(off[settled] < 1e-5), scene
    # fast ramps let slopes ring with the clamp's jerk, and no others are uncertain
    assert np.all(settled | (abs(scene.rate) > 1.5)), scene
