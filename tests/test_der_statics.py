import numpy as np
import pytest

import der
from der.problem import Statics
from der.rod import Rod
from der.states import mirrored, name, reversed_, stable_states, start_state
from ribbonfem import Ribbon, Scene, SceneError, elastica
from ribbonfem.options import OptionError

PLANAR = Scene(compression=0.40, shear=0.0, start="U+")
RIBBON = Scene(compression=0.40, shear=0.40)
# extensible values at (0.40, 0.40) on which three methods agreed, none of them this one
RIBBON_FOLDS = (0.160964943, 0.444944267)


def limit(coarse, fine, nodes):
    ratio = ((nodes[1] - 2) / (nodes[0] - 2)) ** 2
    return (ratio * fine - coarse) / (ratio - 1)


@pytest.mark.parametrize("compression", [0.05, 0.20, 0.40])
def test_planar_folds_against_finite_elements(compression):
    scene = Scene(compression=compression, shear=0.0, start="U+")
    (reference,) = elastica.folds(scene, extensible=True)
    coarse, fine = (der.folds(scene, nodes=n)[0] for n in (101, 201))
    assert abs(coarse.angle / reference.angle - 1) < 6e-4
    assert abs(limit(coarse.angle, fine.angle, (101, 201)) - reference.angle) < 2e-7
    assert abs(limit(coarse.height, fine.height, (101, 201)) - reference.height) < 2e-7
    assert abs(limit(coarse.load, fine.load, (101, 201)) / reference.load - 1) < 1e-6


def test_ribbon_folds_and_second_order():
    angles = {n: np.array([f.angle for f in der.folds(RIBBON, nodes=n)]) for n in (51, 101, 201)}
    assert np.all(np.abs(angles[101] / RIBBON_FOLDS - 1) < 6e-3)
    assert np.abs(limit(angles[101], angles[201], (101, 201)) - RIBBON_FOLDS).max() < 5e-6
    errors = {n: angles[n] - RIBBON_FOLDS for n in angles}
    order = np.log(errors[101] / errors[201]) / np.log(199 / 99)
    assert np.all(np.abs(order - 2) < 0.02), f"expected order 2, observed {order}"


def test_no_mesh_leads_onto_another_curve():
    """A long step landed on one that passes nearby, and took the jump for a branch point: no second fold."""
    for n in range(94, 106):
        off = np.array([f.angle for f in der.folds(RIBBON, nodes=n)]) - RIBBON_FOLDS
        np.testing.assert_allclose(off * (n - 2) ** 2, (7.22, -3.42), rtol=0.01)


def test_two_node_clamp_is_first_order():
    errors = {}
    for n in (101, 201):
        errors[n] = np.array([f.angle for f in der.folds(RIBBON, nodes=n, clamp="two-node")]) - RIBBON_FOLDS
    order = np.log(errors[101] / errors[201]) / np.log(2)
    assert np.all(np.abs(order - 1) < 0.1), f"expected order 1, observed {order}"
    assert np.allclose(errors[101] + RIBBON_FOLDS, [0.1692, 0.4310], atol=1e-4)


def test_even_number_of_nodes():
    (odd,), (even,) = der.folds(PLANAR, nodes=81), der.folds(PLANAR, nodes=82)
    assert abs(odd.angle - even.angle) < 3e-5
    assert abs(odd.height - even.height) < 3e-5


def test_thin_ribbon_is_nearly_inextensible():
    thin = Scene(compression=0.2, shear=0.0, start="U+", ribbon=Ribbon(thickness=1e-3))
    (reference,) = elastica.folds(thin, extensible=True)
    coarse, fine = (der.folds(thin, nodes=n)[0].angle for n in (101, 201))
    assert abs(limit(coarse, fine, (101, 201)) - reference.angle) < 1e-6


def test_mirror_of_the_folds():
    image = Scene(compression=0.40, shear=0.40, start="U-S+", rate=-0.1)
    for plain, other in zip(der.folds(RIBBON, nodes=41), der.folds(image, nodes=41), strict=True):
        assert np.isclose(plain.angle, -other.angle, atol=1e-9)
        assert np.isclose(plain.height, -other.height, atol=1e-7)
    sheared = Scene(compression=0.40, shear=-0.40)
    for plain, other in zip(der.folds(RIBBON, nodes=41), der.folds(sheared, nodes=41), strict=True):
        assert np.isclose(plain.angle, other.angle, atol=1e-9)


def test_named_states():
    rod = Rod(RIBBON, 41)
    states = stable_states(rod)
    assert sorted(states) == ["U+S+", "U+S-", "U-S+", "U-S-"]
    problem = Statics(rod)
    energies = [problem.energy(state) for state in states.values()]
    assert np.ptp(energies) < 1e-9
    for wanted, state in states.items():
        line = problem.linearise(state, 0.0)
        assert np.abs(line.residual).max() < 1e-6
        assert line.index == 0
        position, tangent = rod.middle(state.x)
        assert (position[2] > 0) == (wanted[1] == "+")
        assert (position[0] > 0.3) == (wanted[3] == "+")
        # on U+, S+ leans down and S- up; on U- the other way
        assert (tangent[2] < 0) == (wanted in ("U+S+", "U-S-"))


def test_symmetries_of_states():
    rod = Rod(RIBBON, 31)
    state = start_state(rod)
    assert name(rod, state) == "U+S+"
    assert name(rod, mirrored(state)) == "U-S+"
    assert name(rod, reversed_(state)) == "U-S-"
    back = reversed_(reversed_(state))
    assert np.allclose(back.x, state.x)
    assert np.allclose(back.m1, state.m1)


def test_states_of_small_and_large_shear():
    small = Rod(Scene(compression=0.40, shear=0.05, start="U+"), 41)
    assert sorted(stable_states(small)) == ["U+", "U-"]
    with pytest.raises(SceneError, match=r"U\+S\+.*stable ones are: U\+, U-"):
        start_state(Rod(Scene(compression=0.40, shear=0.05), 41))
    large = stable_states(Rod(Scene(compression=0.40, shear=0.5, start="S+"), 41))
    assert sorted(large) == ["S+", "S-"]
    rod = Rod(Scene(compression=0.40, shear=0.5, start="S+"), 41)
    position, tangent = rod.middle(large["S+"].x)
    assert np.allclose(position, [0.3, -0.25, 0.0], atol=1e-7)
    assert tangent[2] < -0.1
    # U is stable again beside S, at a higher energy
    both = Rod(Scene(compression=0.40, shear=0.65, start="U+"), 41)
    states = stable_states(both)
    assert sorted(states) == ["S+", "S-", "U+", "U-"]
    problem = Statics(both)
    assert problem.energy(states["U+"]) > problem.energy(states["S+"]) + 5.0


def test_folds_of_path_1_and_of_the_final_state():
    (path_1,) = der.folds(Scene(compression=0.40, shear=0.40, start="U+S-"), nodes=51)
    path_2 = der.folds(RIBBON, nodes=51)
    assert np.isclose(path_1.angle, path_2[1].angle, atol=1e-9)
    final = der.folds(Scene(compression=0.40, shear=0.40, start="U-S+"), nodes=51)
    assert final[0].angle > 3.0
    assert len(der.folds(Scene(compression=0.40, shear=0.40, stop=0.3), nodes=51)) == 1


def test_branch_of_path_2():
    branch = der.equilibria(RIBBON, nodes=51)
    assert np.count_nonzero(branch.angle == 0.0) == 1
    start = int(np.flatnonzero(branch.angle == 0.0)[0])
    assert branch.stable[start]
    signs = [np.sign(fold.angle) for fold in branch.folds[:4]]
    assert signs == [1.0, -1.0, 1.0, -1.0]
    assert branch.folds[3].angle < -1.3
    # stable, unstable, stable (the Path 1 sheet), unstable
    changes = np.flatnonzero(np.diff(branch.stable.astype(int)))
    assert len(changes) == 3
    assert branch.configurations.shape == (len(branch), 51, 3)
    assert np.allclose(branch.configurations[:, -2:, 1], -0.40)


def test_refusals():
    with pytest.raises(OptionError, match="nodes = 5"):
        der.folds(PLANAR, nodes=5)
    with pytest.raises(OptionError, match="clamp = 'glued'"):
        der.folds(PLANAR, clamp="glued")
    with pytest.raises(TypeError, match="elements"):
        der.folds(PLANAR, elements=5)
