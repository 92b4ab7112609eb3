"""The laws of ribbons measured: rods on finer meshes, elements on a ladder of meshes and tolerances."""

from __future__ import annotations

from typing import Any

import numpy as np

from compare.chooser.cost_laws import rounded
from compare.chooser.refinement import expected_steps
from compare.chooser.trials import element_snap, random_ribbon, rod_snap
from compare.limits import limit_of
from compare.sweep import Sweep
from ribbonfem import Ribbon, Scene

# meshes of rods that are run one after the other until their extrapolation has settled
MESHES = (31, 51, 76, 101, 151, 201, 301)
# elements and tolerances that are run one after the other until two agree
LADDER = ((4, 1e-4), (6, 3e-5), (8, 1e-5), (8, 3e-6), (10, 1e-6), (12, 3e-7))


def _ribbon(scene: Scene) -> dict[str, Any]:
    runs = [rod_snap(scene, nodes, 1e-4) for nodes in MESHES]
    times = {f"{t:.0e}": rod_snap(scene, 76, t)[0] for t in (1e-6, 1e-5)}
    times["1e-04"] = runs[MESHES.index(76)][0]
    return {"snap": [run[0] for run in runs], "seconds": [run[1] for run in runs], "time": times}


def rods(scenes: int, seed: int, sweep: Sweep) -> dict[str, Any]:
    """Errors of rods on random ribbons: of extrapolated meshes, and of the integration in time."""
    rng = np.random.default_rng(seed)
    drawn = [random_ribbon(rng) for _ in sweep.progress("drawing ribbons", range(scenes))]
    found = sweep("ribbons", _ribbon, drawn)
    rate = np.array([scene.scaled_rate for scene in drawn])
    laws: dict[str, Any] = {"meshes": MESHES, "scenes": scenes, "seed": seed, "time": {}, "mesh": {}}
    best = np.array([f["time"]["1e-06"] for f in found])
    for label in ("1e-04", "1e-05"):
        at = np.array([f["time"][label] for f in found])
        # ribbons that rattle are looked after by the run itself
        laws["time"][label] = float(f"{np.nanquantile(np.abs(at - best) / rate, 0.9):.2g}")
    # the finest has nothing to be measured against; a decade of tolerance takes four fifths of the error
    laws["time"]["1e-06"] = float(f"{laws['time']['1e-05'] / 5.0:.2g}")
    for kind in ("U+S+", "U+S-"):
        chosen = [f["snap"] for f, scene in zip(found, drawn, strict=True) if scene.start == kind]
        laws["mesh"][kind] = [
            float(f"{np.nanmedian([limit_of(s[: k + 1], MESHES[: k + 1])[1] for s in chosen]):.2g}")
            for k in range(1, len(MESHES) - 1)
        ]
    laws["seconds"] = rounded(np.median([f["seconds"] for f in found], axis=0), 2)
    return laws


def _elements(scene: Scene) -> list[tuple[float, float, bool]]:
    return [element_snap(scene, elements, tolerance) for elements, tolerance in LADDER]


def elements(scenes: int, seed: int, sweep: Sweep) -> dict[str, Any]:
    """Errors of the Kirchhoff elements on random ribbons, each rung against the last.

    The bound is one and a half times what 98 % of the smooth scenes stay below: a ribbon that rattles is
    told by its run.  The last rung has nothing to be measured against: two fifths of the one before.
    """
    rng = np.random.default_rng(seed)
    drawn = [random_ribbon(rng) for _ in sweep.progress("drawing ribbons", range(scenes))]
    found = sweep("elements", _elements, drawn, cost=expected_steps)
    snaps = np.array([[run[0] for run in runs] for runs in found])
    smooth = np.array([not runs[0][2] for runs in found])
    errors = np.abs(snaps[:, :-1] - snaps[:, -1:])
    bound = list(1.5 * np.nanquantile(errors[smooth], 0.98, axis=0))
    typical = list(np.nanmedian(errors, axis=0))
    seconds = np.median([[run[1] for run in runs] for runs in found], axis=0)
    unit = Ribbon().inertial_time
    return {
        "ladder": [list(rung) for rung in LADDER],
        "bound": [float(f"{value:.2g}") for value in (*bound, 0.4 * bound[-1])],
        "typical": [float(f"{value:.2g}") for value in (*typical, 0.4 * typical[-1])],
        "seconds": rounded(seconds, 2),
        "rate": [1e-4 * unit, 1.0 * unit],
        "damping": [1e-2 * unit, 1e2 * unit],
        "scenes": scenes,
        "smooth": int(smooth.sum()),
        "seed": seed,
    }
