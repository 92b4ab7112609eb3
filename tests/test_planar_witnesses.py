"""Planar rigs in motion by the elastica, against two witnesses: rods, which share no mechanics, and elements
in three dimensions, which share the element's degree, the mass and the methods, and no kernel of strains.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

import der
from ribbonfem import Drive, Ribbon, Scene, SceneError, SolverError, elastica, kirchhoff

SEED = 20261130
# of the twenty scenes, those that are looked at by default
QUICK = (0, 1)


def drawn(count, retarding=False):
    """Scenes that snap at a fold in the plane, from SEED: sections, paces, drives, presets, loads, shapes."""
    rng = np.random.default_rng(SEED)
    drives = ["left", "right", Drive(left=1.0, right=0.3), Drive(left=1.0, lift=0.05, force=1.0)]
    scenes = []
    while len(scenes) < count:
        drive, rate = drives[int(rng.integers(4))], float(10.0 ** rng.uniform(-1.5, 0.3))
        side = float(rng.choice([-1.0, 1.0]))
        preset = {"left": 0.1, "right": 0.1, "lift": 0.03, "force": 2.0}
        moved = Scene(shear=0.0, start="U+", drive=drive).drives.moved
        weight, ribbon = rng.uniform(-3.0, 3.0, 2), {"thickness": float(10.0 ** rng.uniform(-2.3, -1.7))}
        ribbon["curvature"] = tuple(float(x) for x in rng.uniform(-2.0, 2.0, 3))
        ribbon["retardation"] = float(rng.uniform(0.0, 0.1)) if retarding else 0.0
        scene = Scene(
            compression=float(rng.uniform(0.1, 0.45)),
            shear=0.0,
            start="U+" if side > 0.0 else "U-",
            drive=drive,
            rate=side * rate,
            preset={n: float(rng.uniform(-size, size)) for n, size in preset.items() if n not in moved},
            gravity=tuple(
                w / Ribbon(**ribbon).weight_ratio for w in (float(weight[0]), 0.0, float(weight[1]))
            ),
            damping=float(10.0 ** rng.uniform(-1.0, 1.0)),
            ribbon=Ribbon(**ribbon),
        )
        try:
            result = elastica.instabilities(scene, elements=8)
        except (SceneError, SolverError):
            continue
        if result and result[0].kind == "fold":
            stop = side * min(2.5, abs(result[0].control) + 0.3 + 0.4 * abs(scene.scaled_rate) ** 0.8)
            scenes.append(replace(scene, stop=stop))
    return scenes


def snap(model, scene, **options):
    """The control at which the height passes that of the clamps."""
    result = model.simulate(scene, configurations=False, until="snap", **options).snap
    return np.nan if result is None else result[1]


def rods_limit(scene, meshes, tolerance):
    """Richardson's limits of each two meshes."""
    result = [snap(der, scene, nodes=nodes, tolerance=tolerance) for nodes in meshes]
    return [b + (b - a) / 3.0 for a, b in pairwise(result)]


@pytest.mark.parametrize("index", QUICK)
def test_rods_tend_to_the_elastica(index):
    """Two coarse meshes: their limit errs by less than a hundredth of the finer one's own error."""
    scene = drawn(1 + max(QUICK))[index]
    plane = snap(elastica, scene, elements=8, tolerance=1e-6, extensible=True)
    (rods,) = rods_limit(scene, (51, 101), 1e-5)
    assert abs(rods - plane) < 1e-4, scene


@pytest.mark.slow
@pytest.mark.parametrize("index", range(20))
def test_the_elastica_and_rods_have_one_limit(index):
    """To 1e-5 rad; rods uncertain by the difference of their last two limits."""
    scene = drawn(20)[index]
    coarse, rods = rods_limit(scene, (101, 201, 401), 1e-7)
    plane = snap(elastica, scene, elements=12, tolerance=1e-7, extensible=True)
    print(
        f"{index}: rods {rods:.8f} ({coarse - rods:.0e}), the elastica {plane:.8f}, {plane - rods:.1e} apart"
    )
    assert abs(rods - plane) < 1e-5, scene


def compared(scene, extensible, options):
    """How far snaps and heights of the two are apart, and how well energies balance."""
    runs = [
        model.simulate(scene, configurations=False, extensible=extensible, **options)
        for model in (elastica, kirchhoff)
    ]
    at = np.linspace(0.0, runs[0].time[-1], 60)[1:]
    # (rows are far apart where little happens)
    tracks = (CubicHermiteSpline(run.time, run.height, run.velocity)(at) for run in runs)
    heights = np.abs(np.subtract(*tracks)).max()
    e = runs[0].energies
    total = e["kinetic"] + e["elastic"] + e["potential"] + e["dissipated"] - e["work"]
    off = abs(total - total[0]).max() / max(1.0, abs(e["elastic"]).max())
    return abs(runs[0].snap[1] - runs[1].snap[1]), heights, off


@pytest.mark.parametrize("index", QUICK)
def test_the_elastica_and_elements_in_three_dimensions_move_alike(index):
    """Over drawn rigs that retard too."""
    scene = drawn(1 + max(QUICK), retarding=True)[index]
    snaps, heights, off = compared(scene, index % 2 == 0, {"elements": 8, "tolerance": 3e-6})
    assert snaps < 1e-5, scene
    assert heights < 3e-5, scene
    assert off < 1e-3, scene


@pytest.mark.slow
@pytest.mark.parametrize("index", range(20))
def test_twenty_rigs_move_alike_in_the_plane_and_in_three_dimensions(index):
    """At 1e-7 snaps agree to 1e-6 rad."""
    scene = drawn(20, retarding=True)[index]
    snaps, heights, off = compared(scene, index % 2 == 0, {"elements": 12, "tolerance": 1e-7})
    print(f"{index}: snaps {snaps:.1e} apart, heights {heights:.1e}, balance {off:.1e}")
    assert snaps < 1e-6, scene
    assert off < 1e-4, scene
