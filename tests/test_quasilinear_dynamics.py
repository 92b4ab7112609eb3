"""Motion of the quasi-linear beam."""

from dataclasses import replace

import numpy as np
import pytest

from ribbonfem import Scene, SceneError, quasilinear
from ribbonfem.ends import moving
from ribbonfem.jit.decorator import compiled
from ribbonfem.quasilinear import discretisation
from ribbonfem.quasilinear.kernels import bands, consistent_initialisation, stage
from ribbonfem.quasilinear.problem import Statics
from ribbonfem.stepping.methods import method_of

SCENE = Scene(compression=0.4, shear=0.0, start="U+", rate=0.1, stop=1.4, damping=1.0)


# of 16, 10, 9 and 38 dofs: all places with one, some without, and so many that no inverse is made
MESHES = pytest.mark.parametrize(("elements", "degree"), [(9, 3), (3, 5), (1, 12), (20, 3)])


@compiled()
def _newton_step(model, sigma):
    stage.residual(model, sigma)
    stage.factorise(model, sigma)
    return stage.solve(model, sigma)


@MESHES
def test_kernel_is_the_readable_form(elements, degree):
    """One Newton increment of the kernel against the dense equations of scikit-fem's matrices."""
    problem = Statics(SCENE, elements, degree)
    mesh = problem.mesh
    n = mesh.count
    rng = np.random.default_rng(1)
    z, v, a, load = rng.normal(size=n), rng.normal(size=n), rng.normal(size=n), 33.0
    ends = rng.normal(size=(3, 4))
    sigma, b, nu = 8.1, 0.3, 1.7
    f = (b * sigma - 1.0) / nu
    begin = discretisation.at_rest(problem, problem.start())
    model = discretisation.MovingBeam(problem, begin, method_of("esdirk4").as_scheme(), 2).model
    t = model.scratch
    t.z[:n], t.load[0], t.ends[:] = z, load, ends
    stage.put_loads(model.beam, t, nu)
    # a = (z - zp) / b and v = vp + f a
    rp, vp = z - b * a, v - f * a
    t.known[:n] = sigma * rp - nu * vp
    bands.add_product(model.beam.mass.band, 1.0, t.wide_known, t.loads)
    _newton_step(model, sigma)
    whole = [np.append(free, end) for free, end in zip((z, v, a), ends, strict=True)]
    stretch = mesh.tension @ whole[0]
    residual = mesh.mass @ (whole[2] + nu * whole[1]) + mesh.stiffness @ whole[0] - load * stretch
    dense = np.zeros((n + 1, n + 1))
    dense[:n, :n] = (sigma * mesh.mass + mesh.stiffness - load * mesh.tension)[:n, :n]
    dense[n, :n] = dense[:n, n] = -stretch[:n]
    increment = np.linalg.solve(dense, -np.append(residual[:n], 1.0 - 0.5 * whole[0] @ stretch))
    result = np.append(t.rest[:n], t.change)
    assert not t.rest[n:].any()
    assert np.abs(result - increment).max() < 1e-9 * np.abs(increment).max()


@MESHES
def test_velocities_at_the_kink_are_consistent(elements, degree):
    """The clamp's slope carries mass: its jump moves the rest, with the least kinetic energy that may be."""
    problem = Statics(SCENE, elements, degree)
    begin = discretisation.at_rest(problem, problem.start())
    model = discretisation.MovingBeam(problem, begin, method_of("esdirk4").as_scheme(), 2).model
    mesh, y, t = problem.mesh, model.motion, model.scratch
    n, spin, nu = mesh.count, -0.7, 0.9
    rate = -spin * problem.scale
    t.controls[0] = 0.0, rate, 0.0
    stage.set_ends(model.beam, t.controls, t.ends)
    impulse = consistent_initialisation.project(model.beam, y, t, moving(SCENE), nu)
    z, v, a = (np.append(part[:n], end) for part, end in zip((y.z, y.v, y.a), y.ends, strict=True))
    assert not np.any([y.z[n:], y.v[n:], y.a[n:]])
    assert np.allclose(y.ends[1], [0.0, spin, 0.0, 0.0], rtol=1e-15)
    row = (mesh.tension @ z)[:n]
    # momentum is left alone but for the constraint's own impulse
    momentum = (mesh.mass @ v)[:n]
    assert np.abs(momentum - row * (row @ momentum) / (row @ row)).max() < 1e-12 * np.abs(momentum).max()
    assert abs(z @ mesh.tension @ v) < 1e-12
    assert 0.5 * rate * impulse == pytest.approx(0.5 * v @ mesh.mass @ v, rel=1e-11)
    # and the accelerations keep the length to second order
    assert abs(z @ mesh.tension @ a + v @ mesh.tension @ v) < 1e-9 * (v @ mesh.tension @ v)
    terms = mesh.mass @ (a + nu * v), mesh.stiffness @ z, y.load[0] * (mesh.tension @ z)
    assert np.abs((terms[0] + terms[1] - terms[2])[:n]).max() < 1e-11 * np.abs(terms[1]).max()


def test_snap_converges_with_the_fourth_power_of_the_mesh():
    angle = {
        n: quasilinear.simulate(SCENE, elements=n, step=0.01, until="snap").crossing("height")[1]
        for n in (8, 16, 64)
    }
    order = np.log2(abs(angle[8] - angle[64]) / abs(angle[16] - angle[64]))
    assert 3.7 < order < 4.4


def test_default_snap_and_its_cost():
    """To 6e-6 of what Richardson's rule in the step gives, and of the limit, in few steps."""
    history = quasilinear.simulate(SCENE, until="snap")
    coarse, fine = (
        quasilinear.simulate(SCENE, step=s, method="tr-bdf2", until="snap").crossing("height")[1]
        for s in (0.005, 0.0025)
    )
    assert abs(history.crossing("height")[1] - (4 * fine - coarse) / 3) < 6e-6
    assert abs(history.crossing("height")[1] - 1.16699044) < 6e-6
    assert history.stats["steps"] < 400
    assert history.stats["newton_iterations"] < 2500
    assert history.stats["assemblies"] < 120


def test_length_is_kept_and_the_mirror_image_is_one():
    up = quasilinear.simulate(replace(SCENE, rate=2.0), elements=16, step=0.01)
    assert np.abs(up.configurations["positions"][:, -1, 0] - 0.6).max() < 1e-9
    down = quasilinear.simulate(replace(SCENE, rate=-2.0, stop=-1.4, start="U-"), elements=16, step=0.01)
    assert np.abs(up.height + down.height).max() < 1e-9
    assert np.abs(up.slope + down.slope).max() < 1e-9


def test_at_rest_it_stays_in_the_start_state():
    """A clamp that hardly moves leaves the beam where it was, on the side of its name."""
    case = replace(SCENE, rate=1e-9, stop=1e-8, damping=1.0)
    history = quasilinear.simulate(case, elements=33)
    branch = quasilinear.equilibria(SCENE, elements=33)
    height = branch.height[branch.angle == 0.0][0]
    assert np.abs(history.height - height).max() < 1e-7
    assert height > 0.0


def test_refusals():
    with pytest.raises(SceneError, match="stop"):
        quasilinear.simulate(replace(SCENE, stop=None))
    with pytest.raises(SceneError, match="shear"):
        quasilinear.simulate(Scene(stop=1.0))
