"""An interrupt is answered within a second, whatever is computed; a run in parts is the run in one."""

import signal
import time
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import der
from ribbonfem import Scene, elastica, kirchhoff, quasilinear
from ribbonfem import row_buffer as growing

RIBBON = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.3, stop=0.9, damping=1.0, hold=5.0)
BEAM = Scene(compression=0.40, shear=0.0, start="U+", rate=0.3, stop=1.4, damping=1.0, hold=5.0)
LONG = {"method": "implicit-euler", "step": 1.5e-5}
BARE = {**LONG, "configurations": False}


class Stopped(Exception):
    pass


@pytest.mark.parametrize(
    ("model", "scene", "options"),
    [
        (der, RIBBON, {"nodes": 51, **BARE}),
        (der, RIBBON, {"nodes": 801, **BARE}),
        (der, RIBBON, {"nodes": 151, **LONG}),
        (kirchhoff, RIBBON, {"elements": 8, **BARE}),
        (kirchhoff, RIBBON, {"elements": 40, **LONG}),
        (elastica, BEAM, {"elements": 10, **LONG}),
        (elastica, BEAM, {"elements": 300, **LONG}),
        (quasilinear, BEAM, {"elements": 32, **LONG}),
        # hardly a row is kept
        (der, RIBBON, {"nodes": 51, "every": 10_000, **BARE}),
        (kirchhoff, RIBBON, {"elements": 8, "every": 10_000, **LONG}),
        (elastica, BEAM, {"elements": 10, "every": 10_000, **LONG}),
    ],
)
def test_a_long_run_is_interrupted_within_a_second(model, scene, options):
    # compiled before the clock starts; the second time it takes what comes before the loop
    for _ in range(2):
        began = time.process_time()
        model.simulate(replace(scene, stop=1e-4, hold=0.0), **options)
        before_loop = time.process_time() - began

    def stop(*_):
        raise Stopped

    before = signal.signal(signal.SIGPROF, stop)
    began, after = time.process_time(), 0.1 + 1.5 * before_loop
    try:
        signal.setitimer(signal.ITIMER_PROF, after)
        with pytest.raises(Stopped):
            model.simulate(scene, **options)
        assert time.process_time() - began < after + 1.0
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


@cache
def in_one(model, scene, options):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(growing, "_AT_ONCE", 10**12)
        return model.simulate(scene, **dict(options))


@pytest.mark.parametrize("at_once", [1, 3_000, 17_000])
@pytest.mark.parametrize(
    ("model", "options"),
    [
        (der, {"nodes": 31}),
        (der, {"nodes": 31, "configurations": False, "every": 3}),
        (der, {"nodes": 31, "method": "generalised-alpha"}),
        (kirchhoff, {"elements": 4}),
        (kirchhoff, {"elements": 4, "configurations": False, "every": 3}),
        (kirchhoff, {"elements": 4, "method": "generalised-alpha"}),
        (kirchhoff, {"elements": 4, "method": "implicit-euler", "step": 5e-3}),
        (elastica, {"elements": 4}),
        (quasilinear, {"elements": 4}),
    ],
)
def test_a_run_in_parts_is_the_run_in_one(model, options, at_once, monkeypatch):
    scene = replace(BEAM if model in (elastica, quasilinear) else RIBBON, hold=0.2)
    whole = in_one(model, scene, tuple(options.items()))
    monkeypatch.setattr(growing, "_AT_ONCE", at_once)
    assert model.simulate(scene, **options) == whole
    assert np.isfinite(whole.height).all()
