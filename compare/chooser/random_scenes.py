"""Random scenes and their snaps by single runs: samples to calibrate and to check the cost laws."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Any

import numpy as np

import der
from ribbonfem import Ribbon, Scene, SceneError, SolverError, elastica, kirchhoff

from .refinement import endless, vibrates

_WEIGHTLESS = (0.0, 0.0, 0.0)


def planar_scene(compression: float, rate: float, damping: float, thickness: float = 0.01) -> Scene:
    """U+ under a ramp whose rate and damping are times t*; it ends far behind any snap."""
    ribbon = Ribbon(thickness=thickness)
    unit = ribbon.inertial_time
    return Scene(
        compression=compression,
        shear=0.0,
        start="U+",
        rate=rate / unit,
        damping=damping / unit,
        stop=12.0,
        gravity=_WEIGHTLESS,
        ribbon=ribbon,
    )


def planar_snap(scene: Scene, elements: int, tolerance: float) -> tuple[float, float]:
    """Angle of the snap of a run, and its CPU seconds."""
    begin = time.process_time()
    rest: dict[str, Any] = {"elements": elements, "tolerance": tolerance, "until": "snap"}
    history = elastica.simulate(scene, extensible=True, **rest)
    result = history.crossing()
    return (float("nan") if result is None else result[1]), time.process_time() - begin


def random_planar(rng: np.random.Generator, thickness: float = 0.01) -> Scene:
    """A planar scene inside of the laws: dL uniform, rate and damping log-uniform."""
    rate, damping = 10.0 ** rng.uniform(-4.0, 0.25), 10.0 ** rng.uniform(-2.0, 2.25)
    return planar_scene(rng.uniform(0.02, 0.5), rate, damping, thickness)


def random_ribbon(rng: np.random.Generator) -> Scene:
    """A sheared scene whose start is a stable state, of coarse rods and of fine ones.

    dL/L uniform in 0.1..0.5, dW uniform in 0.1..0.9 of its limit, U+S+ or U+S-; rate log-uniform in
    1e-4..1 rad/s, nu in 1e-2..1e2 1/s.  Its ramp has no stop.
    """
    while True:
        compression = rng.uniform(0.1, 0.5)
        shear = (compression * (2.0 - compression)) ** 0.5 * rng.uniform(0.1, 0.9)
        start = str(rng.choice(["U+S+", "U+S-"]))
        rate, damping = 10.0 ** rng.uniform(-4.0, 0.0), 10.0 ** rng.uniform(-2.0, 2.0)
        scene = Scene(compression=compression, shear=shear, start=start, rate=rate, damping=damping)
        try:
            for nodes in (51, 201):
                # a ramp too short to do anything: does the ribbon have this start?
                short = replace(scene, rate=1.0, stop=1e-6)
                der.simulate(short, nodes=nodes, configurations=False)
        except SceneError:
            continue
        return scene


def random_scene(rng: np.random.Generator, *, planar: bool) -> Scene:
    """A scene of any section and pace: planar, U+, or sheared, U+S+ or U+S-, where that is a stable state.

    h/L is log-uniform in 0.004..0.02, rate in 0.03..5 rad/s, nu in 0.1..20 1/s; dL/L uniform in 0.05..0.5 of
    planar scenes, in 0.1..0.5 of the others, dW uniform in 0.1..0.9 of its limit.  The ramp has no stop.
    """

    def log_uniform(low: float, high: float) -> float:
        return math.exp(rng.uniform(math.log(low), math.log(high)))

    while True:
        drawn: dict[str, Any] = {"ribbon": Ribbon(thickness=log_uniform(0.004, 0.02)), "gravity": _WEIGHTLESS}
        drawn |= {"rate": log_uniform(0.03, 5.0), "damping": log_uniform(0.1, 20.0)}
        if planar:
            return Scene(compression=rng.uniform(0.05, 0.5), shear=0.0, start="U+", **drawn)
        compression, start = rng.uniform(0.1, 0.5), str(rng.choice(["U+S+", "U+S-"]))
        shear = (compression * (2.0 - compression)) ** 0.5 * rng.uniform(0.1, 0.9)
        scene = Scene(compression=compression, shear=shear, start=start, **drawn)
        try:
            for elements in (8, 16):
                kirchhoff.state(scene.at_rest, elements=elements, extensible=True)
        except (SceneError, SolverError):
            continue
        return scene


def element_snap(scene: Scene, elements: int, tolerance: float) -> tuple[float, float, bool]:
    """Angle of the snap of a run of elements (nan: none), its CPU seconds, whether it vibrates."""
    begin = time.process_time()
    options: dict[str, Any] = {"elements": elements, "tolerance": tolerance, "extensible": True}
    try:
        history = kirchhoff.simulate(endless(scene), configurations=False, until="snap", **options)
    except (SceneError, SolverError):
        return float("nan"), time.process_time() - begin, False
    result = history.crossing()
    angle = float("nan") if result is None else result[1]
    return angle, time.process_time() - begin, vibrates(history, scene)


def rod_snap(scene: Scene, nodes: int, tolerance: float, method: str = "tr-bdf2") -> tuple[float, float]:
    """Angle of the snap of a rod (nan where there is none), and the CPU seconds of the run."""
    begin = time.process_time()
    try:
        history = der.simulate(
            endless(scene),
            nodes=nodes,
            method=method,
            tolerance=tolerance,
            configurations=False,
            until="snap",
        )
    except (SceneError, SolverError):
        return float("nan"), time.process_time() - begin
    result = history.crossing()
    return (float("nan") if result is None else result[1]), time.process_time() - begin
