"""The start of a scene is found by long steps on a coarse mesh: it is the state that a full search finds."""

import numpy as np
import pytest

from ribbonfem import Ribbon, Scene, SceneError, kirchhoff
from ribbonfem.kirchhoff import states


def scenes(count):
    """Ribbons sheared to all sides of the pitchforks, by a written seed, with a mesh each."""
    rng = np.random.default_rng(11)
    for _ in range(count):
        compression = rng.uniform(0.1, 0.93)
        shear = rng.uniform(0.3, 0.65) * states.most_shear(compression) * rng.choice([-1.0, 1.0])
        ribbon = Ribbon(thickness=rng.uniform(0.004, 0.02), width=rng.uniform(0.05, 0.4))
        start = str(rng.choice(["U+S+", "U+S-", "U-S+", "U-S-"]))
        options = {"elements": int(rng.choice([6, 8, 12])), "extensible": bool(rng.integers(2))}
        yield Scene(compression=compression, shear=shear, start=start, ribbon=ribbon), options


def test_starts_are_those_of_the_full_search():
    met = 0
    for scene, options in scenes(60):
        result = states.families(states.in_shear(scene, **options), abs(scene.shear)).get("US")
        if result is None or result[1]:
            with pytest.raises(SceneError, match="not a stable equilibrium"):
                states.named(scene, **options)
            continue
        problem, state = states.named(scene, **options)
        met += 1
        force = result[0].force * [1.0, np.sign(scene.shear), 1.0]
        # the mirror image in z turns the force round with it
        assert np.abs(state.force[:2] - force[:2]).max() < 1e-8, scene
        assert abs(abs(state.force[2]) - abs(force[2])) < 1e-8, scene
        assert problem.energy(state) == pytest.approx(problem.energy(result[0]), rel=1e-11), scene
        given = kirchhoff.state(scene, **options)
        assert (given.name, given.index) == (scene.start, 0)
    assert met >= 20


def test_a_start_beside_a_pitchfork_is_found_by_the_full_search():
    # so close to it the branches of a coarse mesh and of a fine one lie on different sides
    near = kirchhoff.pitchforks(0.4, elements=12).broken + 2e-6
    scene = Scene(compression=0.4, shear=near, start="U+S-")
    coarse = kirchhoff.pitchforks(0.4, elements=4).broken
    assert coarse != pytest.approx(near, abs=2e-6)
    state = kirchhoff.state(scene, elements=12)
    assert (state.name, state.index) == ("U+S-", 0)
