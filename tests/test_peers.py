import json
from dataclasses import replace

import numpy as np
import pytest

from compare.external import auto as peer_auto
from compare.external import exudyn as peer_exudyn
from compare.external import pyelastica as peer_pyelastica
from compare.report.registry import publish
from compare.studies.peers import attempts as peers
from compare.studies.peers import study as question
from compare.studies.study import here
from ribbonfem import Scene, SceneError, SolverError, elastica, kirchhoff
from ribbonfem.closed_form import euler


def _run(error, seconds, mesh=10, step="0.01 s", note=""):
    known = {"error": error, "seconds": seconds, "note": note}
    return peers.Attempt("code", f"{mesh} quadratic", step, lambda: (error, seconds), **known)


def test_cheapest_is_the_quickest_of_the_good():
    runs = [_run(2e-4, 0.1), _run(-9e-5, 0.2), _run(1e-5, 0.3)]
    assert peers.cheapest(runs) is runs[1]
    assert peers.cheapest(runs[:1]) is None


def test_settled_passes_over_an_error_that_cancels():
    lucky = _run(1e-5, 0.1, mesh=16, step="0.02 s")
    coarse = _run(2e-4, 0.2, mesh=16, step="0.01 s")
    kept = _run(5e-5, 0.3, mesh=20, step="0.01 s")
    other = _run(9e-4, 0.9, mesh=40, step="0.01 s", note="another kind")
    assert peers.cheapest([lucky, coarse, kept, other]) is lucky
    assert peers.settled([lucky, coarse, kept, other]) is kept
    assert peers.settled([lucky, coarse, other]) is None


def test_alternate_takes_ratios_within_a_round():
    # a machine that is twice as slow in the second round
    slow = iter([1.0, 2.0, 1.0])
    slower = iter([3.0, 6.0, 4.0])
    runs = [
        peers.Attempt("a", "", "", lambda: (0.0, next(slow))),
        peers.Attempt("b", "", "", lambda: (0.0, next(slower))),
    ]
    peers.alternate(runs, 3, here(None))
    assert runs[0].timing.ratio == (1.0, 1.0, 1.0)
    assert runs[1].timing.ratio == (3.0, 3.0, 4.0)


def test_a_failure_is_a_row():
    def go():
        raise SolverError("it stopped\nfor some reason")

    run = peers.Attempt("code", "10 elements", "0.1 s", go)
    run.once()
    assert run.timing.note == "it stopped"
    assert not run.timing.done


def test_closed_form_shape_is_the_elastica():
    s = np.linspace(0.0, 1.0, 9)
    (x, z), phi = euler.shape(0.4, s), euler.tangent_angle(0.4, s)
    branch = elastica.equilibria(Scene(compression=0.4, shear=0.0, start="U+"), span=(-0.1, 0.1))
    middle = branch.height[np.argmin(np.abs(branch.angle))]
    assert np.allclose([x[-1], z[-1], phi[0]], [0.6, 0.0, 0.0], atol=1e-10)
    assert abs(z[4] - middle) < 1e-9


def test_equations_of_auto_hold_in_the_start_state():
    # the moments' equation, by differences of the rows that AUTO is given
    scene = Scene(compression=0.4, shear=0.4)
    rows, force = peer_auto.start(scene, points=401)
    s, q, m = rows[:, 0], rows[:, 1:5], rows[:, 5:]
    assert np.allclose(np.linalg.norm(q, axis=1), 1.0, atol=1e-8)
    assert np.allclose(q[[0, -1]], [1.0, 0.0, 0.0, 0.0], atol=1e-9)
    w, x, y, z = q.T
    columns = np.array(
        [
            [1 - 2 * (y**2 + z**2), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x**2 + z**2), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x**2 + y**2)],
        ]
    )
    n = np.einsum("i,ijs->sj", force, columns)
    omega = m / [scene.ribbon.twist_ratio, 1.0, scene.ribbon.bending_ratio]
    rate = np.cross(m, omega) + np.column_stack((np.zeros(len(s)), n[:, 2], -n[:, 1]))
    result = np.gradient(m, s, axis=0, edge_order=2)
    assert np.abs(result - rate)[2:-2].max() < 2e-3 * np.abs(rate).max()


def test_equations_carry_the_scene():
    text = peer_auto.equations(Scene(compression=0.4, shear=0.4), np.array([1.0, 2.0, 3.0]))
    assert "@" not in text
    assert "5.99999999999999978d-01, -4.00000000000000022d-01" in text


def test_auto_finds_the_folds():
    if peer_auto.missing():
        pytest.skip(peer_auto.missing())
    scene = Scene(compression=0.40, shear=0.40)
    program = peer_auto.Auto(scene)
    try:
        result = program.run(largest=2.0)
    finally:
        program.close()
    ours = kirchhoff.equilibria(scene, elements=32, unstable=1).folds
    assert np.abs(np.array(result.folds) - [fold.angle for fold in ours[:4]]).max() < 1e-7
    assert result.seconds > 0.0


def test_exudyn_snaps_where_the_elastica_does():
    pytest.importorskip("exudyn")
    history = peer_exudyn.simulate(peers.PLANAR, elements=20, step=1e-2, newton_tolerance=1e-4)
    time, angle = history.crossing()
    assert abs(angle - 1.1595506) < 1e-4
    assert abs(angle - 0.1 * time) < 1e-12


def test_exudyn_on_the_ribbon_needs_a_full_newton():
    pytest.importorskip("exudyn")
    scene = replace(peers.RIBBON, stop=0.02)
    options = {"elements": 20, "step": 1e-2, "shear": 1.0}
    history = peer_exudyn.simulate(scene, modified_newton=False, **options)
    assert abs(history.height[-1] - 0.254) < 0.02
    with pytest.raises(SolverError, match="Exudyn"):
        peer_exudyn.simulate(scene, **options)


def test_pyelastica_starts_at_rest_and_turns():
    pytest.importorskip("elastica")
    scene = replace(peers.PLANAR, stop=0.01)
    history = peer_pyelastica.simulate(scene, nodes=21)
    assert abs(history.height[-1] / history.height[0] - 1.0) < 0.01
    with pytest.raises(SolverError, match="no message"):
        peer_pyelastica.simulate(scene, nodes=21, step=6e-5)


def test_the_rest_runs_without_peers(monkeypatch, tmp_path):
    for module in (peer_exudyn, peer_pyelastica, peer_auto):
        monkeypatch.setattr(module, "missing", lambda: "it is not installed")
    monkeypatch.setattr(peers, "planar_truth", lambda extensible=True: 1.1595506 if extensible else 1.159895)
    monkeypatch.setattr(peers, "ribbon_truth", lambda: 0.60642)
    monkeypatch.setattr(peers, "RODS", (51,))
    section, _ = publish(question.COMMAND, question.main(rounds=1), tmp_path)
    assert section.values["missing"] == ["it is not installed"] * 3
    assert (tmp_path / "peers.png").exists()
    ours = {"elastica FEM", "elastica FEM, EA", "Kirchhoff FEM", "DER"}
    assert {row["code"] for row in section.values["planar"]} == ours
    assert {row["code"] for row in section.values["ribbon"]} == {"Kirchhoff FEM", "DER"}
    with pytest.raises(SolverError, match="not installed"):
        peer_exudyn.simulate(peers.PLANAR)
    json.dumps(section.values)


def test_scenes_need_a_stop():
    with pytest.raises(SceneError, match="stop"):
        peer_exudyn.simulate(Scene(compression=0.4, shear=0.0, start="U+"))
