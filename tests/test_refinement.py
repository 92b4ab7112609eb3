from dataclasses import replace

import numpy as np
import pytest

import der
from compare import convergence
from compare.limits import richardson, triple_order
from compare.quantities.measure import QUANTITIES, Shape, unknowns
from ribbonfem import Scene, Schedule, elastica, kirchhoff, quasilinear
from ribbonfem.options import OptionError

REST = Scene(compression=0.40, shear=0.0, start="U+")
SHEARED = Scene(compression=0.40, shear=0.37, start="U+S-")
RAMP = Scene(compression=0.40, shear=0.0, start="U+", rate=0.1, damping=1.0, stop=1.25)
# its end is before the snap, where the motion is slow
SHORT = Scene(compression=0.40, shear=0.0, start="U+", rate=0.5, damping=1.0, stop=0.5)


def told(result):
    return f"declared {result.expected}, observed {result.orders}\n{result}"


def test_elastica_is_of_tenth_order():
    # (where the beam is bent more, its error changes sign on the way: many meshes show the order there, in
    # `test_elastica`)
    flat = replace(REST, compression=0.10)
    result = convergence(elastica, flat, "fold", over={"elements": (24, 8, 16, 12)})
    assert result.at == (8, 12, 16, 24)
    assert result.expected == 10.0
    assert abs(result.order - 10.0) < 0.5, told(result)
    # the elements of another model, which share no mechanics
    (other,) = kirchhoff.folds(flat)
    assert abs(result.limit - other.angle) < 1e-10
    assert result.dofs == (41, 61, 81, 121)


def test_quasilinear_is_of_fourth_order_against_the_closed_form():
    exact = quasilinear.closed_form_fold().mu * 0.40**0.5
    result = convergence("quasilinear", REST, "fold", over={"elements": (16, 32, 64)}, reference=exact)
    assert abs(result.order - 4.0) < 0.1, told(result)
    assert result.limit == exact
    assert result.orders.shape == (2,)


@pytest.mark.parametrize(("clamp", "order"), [("centred", 2.0), ("two-node", 1.0)])
def test_rods_on_the_mesh(clamp, order):
    meshes = (51, 101, 201) if order == 2.0 else (101, 201, 401)
    result = convergence(der, SHEARED, "fold", over={"nodes": meshes}, clamp=clamp)
    assert result.expected == order
    assert abs(result.order - order) < 0.15 * order, told(result)
    assert result.verified


@pytest.mark.parametrize(
    ("model", "mesh", "steps"),
    [(elastica, {"elements": 6}, (2e-2, 1e-2, 5e-3)), (der, {"nodes": 26}, (1e-2, 5e-3, 2.5e-3))],
)
@pytest.mark.parametrize(("method", "order"), [("newmark", 2), ("implicit-euler", 1)])
def test_methods_on_the_step(model, mesh, steps, method, order):
    result = convergence(model, RAMP, "snap", over={"step": steps}, method=method, **mesh)
    assert result.expected == order
    assert abs(result.order - order) < 0.15 * order, told(result)
    assert np.all(result.seconds > 0.0)


@pytest.mark.parametrize("quantity", ["shape", "energy", "height"])
def test_rest_states(quantity):
    result = convergence("der", REST, quantity, over={"nodes": (51, 101, 201)})
    assert abs(result.order - 2.0) < 0.1, told(result)
    assert result.verified


def test_quantities_of_a_ramp_end_where_it_stops():
    options = {"method": "newmark", "step": 1e-2}
    shape = convergence("elastica", SHORT, "shape", over={"elements": (8, 16, 24)}, **options)
    assert shape.errors[0] > 10.0 * shape.errors[1] > 0.0
    assert shape.values[0].shape == (9, 3)
    energy = convergence("elastica", SHORT, "energy", over={"elements": (8, 16, 24)}, **options)
    history = elastica.simulate(SHORT, elements=24, **options)
    assert energy.values[-1] == history.energies["kinetic"][-1] + history.energies["elastic"][-1]
    balance = convergence(
        "elastica", SHORT, "balance", over={"step": (1e-2, 5e-3)}, method="newmark", elements=8
    )
    assert balance.limit == 0.0
    assert balance.errors[1] < balance.errors[0]


def test_a_function_is_a_quantity():
    def load(model, scene, **options):
        return model.folds(scene, **options)[0].load

    result = convergence(kirchhoff, REST, load, over={"elements": (6, 8, 10)})
    assert result.quantity == "load"
    assert abs(result.limit - kirchhoff.folds(REST)[0].load) < 1e-4


def test_a_sequence_that_does_not_converge_is_not_verified():
    def wandering(model, scene, nodes):
        return float(np.sin(nodes))

    result = convergence(der, REST, wandering, over={"nodes": (11, 21, 41, 81)})
    assert not result.verified
    assert "NOT verified" in str(result)
    # falls, but with another order than the one declared
    sizes = (0.4, 0.2, 0.1)
    slow = richardson([1.0 + h for h in sizes], sizes, 2.0)
    assert not slow.verified
    assert np.isclose(slow.orders[-1], 1.0)
    assert slow.uncertainty > 0.05


def test_richardson_knows_the_limit_of_a_power():
    sizes = (1 / 8, 1 / 12, 1 / 20, 1 / 31)
    for order in (1.0, 2.0, 6.0):
        values = [np.array([1.5, -2.0]) + np.array([3.0, 1.0]) * h**order for h in sizes]
        result = richardson(values, sizes, order)
        assert result.verified
        assert np.allclose(result.value, [1.5, -2.0], atol=1e-12)
        assert np.allclose(result.orders, order, rtol=1e-5)
        assert richardson(values, sizes).verified
    assert np.isnan(triple_order([1.0, 2.0, 1.5], (0.4, 0.2, 0.1)))
    constant = richardson([0.3, 0.3, 0.3], (0.4, 0.2, 0.1), 2.0)
    assert constant.verified
    assert constant.value == 0.3
    with pytest.raises(ValueError, match="must fall"):
        richardson([1.0, 1.1, 1.2], (0.1, 0.2, 0.3))


def test_shapes_are_compared_where_they_have_points():
    s = np.linspace(0.0, 1.0, 41)
    fine = Shape(s, np.column_stack((s, np.sin(3 * s), 0 * s)))
    coarse = Shape(s[::5], fine.r[::5] + [0.0, 0.0, 1e-3])
    assert np.isclose(coarse.distance(fine), 1e-3)
    assert np.abs(fine.at(np.array([0.1234])) - [0.1234, np.sin(0.3702), 0.0]).max() < 1e-10


@pytest.mark.parametrize(
    ("model", "quantity", "over", "options", "named"),
    [
        (elastica, "fold", {"nodes": (11, 21, 41)}, {}, "nodes = .*elastica.folds takes elements"),
        (der, "fold", {"step": (1e-2, 5e-3, 1e-3)}, {}, "step = .*der.folds takes nodes"),
        (elastica, "fold", {"elements": (8, 16, 32)}, {"clamp": "centred"}, "clamp = 'centred'"),
        (elastica, "fold", {"elements": (8, 16)}, {}, "3 different values"),
        (elastica, "fold", {"elements": (8, 16, 32), "step": (1, 2, 3)}, {}, "a mapping of one of"),
        (elastica, "fold", {"elements": (8.5, 16, 32)}, {}, "elements = 8.5"),
        (elastica, "angle", {"elements": (8, 16, 32)}, {}, "quantity = 'angle'.*'fold'"),
        ("beam", "fold", {"elements": (8, 16, 32)}, {}, "model = 'beam'.*quasilinear"),
    ],
)
def test_what_cannot_be_refined_is_named(model, quantity, over, options, named):
    with pytest.raises(OptionError, match=named):
        convergence(model, REST, quantity, over=over, **options)


def test_unknowns_are_counted_as_the_models_have_them():
    beam = Scene(compression=0.2, shear=0.0, start="U+", rate=1.0, stop=1.0)
    assert unknowns("der", {"nodes": 51}, beam, False) == 4 * 51 - 15
    assert unknowns("quasilinear", {"elements": 8}, beam, True) == 15
    assert unknowns("quasilinear", {"elements": 1, "degree": 11}, beam, True) == 9
    assert unknowns("elastica", {}, beam, False) == 5 * 16 + 1
    # its mesh is of the scene where nobody gives one
    for compression, elements in ((0.2, 4), (0.4, 8)):
        assert unknowns("elastica", {}, replace(beam, compression=compression), True) == 25 * elements - 3
    assert unknowns("quasilinear", {}, beam, True) == 16
    assert set(QUANTITIES) >= {"fold", "first fold", "snap", "first snap", "shape", "energy", "height"}


def test_steps_are_refined_on_the_mesh_of_what_a_motion_begins_with():
    beam = Scene(compression=0.2, shear=0.0, start="U+", rate=1.0, stop=1.0)
    state = elastica.state(beam, elements=6)
    refined = convergence(elastica, beam, "snap", {"tolerance": (1e-4, 1e-5, 1e-6)}, initial=state)
    assert refined.dofs == (25 * 6 - 3,) * 3


def test_the_end_of_a_schedule_is_that_of_its_motion():
    """Not the start at rest, which a scene without an end has."""
    given = {"compression": 0.40, "shear": 0.37, "start": "U+S+", "damping": 2.0}
    scene = Scene(**given, schedule=Schedule((0, 2, 3), (0, 0.9, 0.9), "linear"))
    ramp = Scene(**given, rate=0.45, stop=0.9, hold=1.0)
    run = kirchhoff.simulate(ramp, elements=8)
    result = convergence("kirchhoff", scene, "height", over={"elements": (4, 6, 8)})
    assert result.values[-1] == pytest.approx(run.height[-1], abs=1e-6)
    assert run.height[-1] < 0.0
    shapes = convergence("kirchhoff", scene, "shape", over={"elements": (4, 6, 8)})
    assert np.isfinite(shapes.errors).all()


def test_a_control_that_turns_back_tells_no_snap():
    back = Scene(schedule=Schedule((0, 2, 3), (0, 0.9, 0.7)))
    with pytest.raises(OptionError, match=r"quantity = 'snap'.*'snap time' does"):
        convergence("kirchhoff", back, "snap", over={"elements": (4, 6, 8)})
