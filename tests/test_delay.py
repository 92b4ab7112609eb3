"""The normal form at a fold, its universal curve, and the delay it predicts."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ribbonfem import Ribbon, Scene, continuation, delay, elastica, quasilinear
from ribbonfem.delay.collocation import integrate
from ribbonfem.delay.universal_curve import _outer, universal_fit

SCENE = Scene(compression=0.4, shear=0.0, start="U+", rate=0.1, stop=1.4, damping=1.0)
FREE = 2.338107410459767  # first zero of Ai(-x)


def form(model, scene, *options):
    problem = model.problem.Statics(scene, *options)
    return delay.ramp_normal_forms(problem, problem.start(), scene)[0]


def test_universal_curve_limits():
    assert delay.universal(0.0) == pytest.approx(3.41167179, abs=1e-7)
    # friction alone: a' = t + a^2 leaves at the first zero of Airy's function
    assert delay.universal(1e6) / 1e4 == pytest.approx(FREE, rel=1e-7)
    # the next order is Lambda^(-5/3)
    off = [delay.universal(x) / x ** (2 / 3) / FREE - 1 for x in (1e2, 1e3)]
    assert off[0] / off[1] == pytest.approx(10 ** (5 / 3), rel=0.4)
    assert delay.universal(1e-6) - delay.universal(0.0) == pytest.approx(
        1e-5 * (delay.universal(0.1) - delay.universal(0.0)), rel=0.02
    )


def test_the_series_of_the_universal_curve_is_the_curve():
    damping = np.array([0.0, 1e-3, 0.07, 0.9, 1.1, 13.0, 170.0, 990.0, 1e3, 1.1e3, 1e7])
    exact = np.array([delay.universal(float(value)) for value in damping])
    assert universal_fit(damping) == pytest.approx(exact, rel=2e-7)
    assert universal_fit(np.asarray(5e3)) == delay.universal(5e3)


def test_universal_curve_where_friction_rules():
    """The next order behind Airy's zero falls as Lambda^(-5/3), at no damping with a break."""
    values = np.geomspace(50.0, 3e4, 40)
    off = np.array([delay.universal(x) / x ** (2 / 3) / FREE - 1 for x in values]) * values ** (5 / 3)
    # to a logarithm, which is straight in log Lambda
    bends = np.diff(off, 2)
    assert np.all(np.diff(off) > 0.0)
    assert np.abs(bends[1:] - bends[:-1]).max() < 0.02 * np.abs(np.diff(off)).mean()


def test_collocation_of_a_stiff_equation_with_a_known_solution():
    """y' = -k (y - sin t) + cos t from sin: sin t, whatever k, in some tens of steps."""
    for k in (0.0, 1.0, 1e4, 1e10):
        calls = []

        def rate(t, y, k=k, calls=calls):
            calls.append(t)
            return -k * (y - np.sin(t)) + np.cos(t)

        assert integrate(rate, 0.0, 20.0, np.zeros(1))[0] == pytest.approx(math.sin(20.0), abs=1e-12)
        assert len(calls) < 600


@pytest.mark.parametrize("damping", [0.0, 0.3, 1.0, 1.5, 4.0])
def test_universal_curve_against_plain_integration(damping):
    """From the slow solution far before the fold to a = 1e6; what is left is sqrt(6 / a) + 0.6 Lambda / a."""
    start = _outer(1.0, damping, 30.0)

    def end(t, y):
        return y[0] - 1e6

    end.terminal = True
    run = solve_ivp(
        lambda t, y: (y[1], t + y[0] ** 2 - damping * y[1]),
        (-30.0, 20.0),
        start,
        events=end,
        method="DOP853",
        rtol=1e-12,
        atol=1e-12,
    )
    assert run.t_events[0][0] + np.sqrt(6e-6) + 6e-7 * damping == pytest.approx(
        delay.universal(damping), abs=2e-8
    )


def test_closed_form_of_the_quasilinear_beam():
    """c a2 = 137470.385 for the rate of mu in t*; and the finite elements tend to it."""
    unit = Ribbon().inertial_time
    closed = delay.quasilinear_normal_form(SCENE)
    assert closed.product * unit**4 * 0.4**0.5 == pytest.approx(137470.385, abs=1e-3)
    assert closed.angle == pytest.approx(1.78177604115671 * 0.4**0.5, rel=1e-13)
    off = [form(quasilinear, SCENE, n).product / closed.product - 1 for n in (16, 32)]
    assert abs(off[1]) < 2e-5
    assert np.log2(off[0] / off[1]) == pytest.approx(4.0, abs=0.2)


def test_mirror_image():
    up = form(elastica, SCENE, 16, False)
    down = form(elastica, replace(SCENE, start="U-", rate=-0.1, stop=None), 16, False)
    assert down.angle == pytest.approx(-up.angle, abs=1e-9)
    assert down.product == pytest.approx(-up.product, rel=1e-6)
    assert delay.predict(down, -0.1, 1.0).angle == pytest.approx(-delay.predict(up, 0.1, 1.0).angle, rel=1e-6)
    with pytest.raises(ValueError, match="does not meet the fold"):
        delay.predict(down, 0.1, 1.0)
    closed = delay.quasilinear_normal_form(replace(SCENE, start="U-"))
    assert closed.product < 0.0


@pytest.mark.parametrize(
    ("model", "options"), [(quasilinear, (32,)), (elastica, (16, False)), (elastica, (16, True))]
)
def test_null_vector_and_frequencies_agree(model, options):
    """Two ways to c a2: third derivatives at the fold, and omega^4 along the stable branch."""
    problem = model.problem.Statics(SCENE, *options)
    fold = delay.ramp_normal_forms(problem, problem.start(), SCENE)[0]
    distances = np.array([1e-3, 5e-4, 2e-4, 1e-4])
    squares = []
    for distance in distances:
        first = continuation.first_point(problem, problem.start(), 0.0, 1.0)
        *_, last = continuation.trace(problem, first, (-1.0, fold.angle - distance))
        squares.append(delay.frequency(problem, last.end.state, fold.angle - distance))
    result = delay.product_from_frequencies(fold.angle - distances, np.array(squares), fold.angle)
    assert result == pytest.approx(fold.product, rel=2e-3)


def test_extensible_elastica_has_the_coefficient_of_rods():
    """omega^4 of a discrete elastic rod of 51 nodes has the slope 9.65e5 s^-4/rad; its mesh error is 3 %."""
    assert 4 * form(elastica, SCENE, 16, True).product == pytest.approx(9.65e5, rel=0.03)


@pytest.mark.parametrize("model", [quasilinear, elastica])
@pytest.mark.parametrize(
    ("damping", "rates", "power"), [(1e-3, (1e-3, 1e-4, 1e-5), 0.2), (1e3, (1e-5, 1e-6, 1e-7), 1 / 3)]
)
def test_measured_delay_tends_to_the_predicted(model, damping, rates, power):
    """Simulated over predicted, at slow rates and extrapolated to none; the fold is that of the same mesh."""
    options = (32,) if model is quasilinear else (12, False)
    fold = form(model, SCENE, *options)
    ratio = []
    for rate in rates:
        case = replace(SCENE, rate=rate, damping=damping)
        history = model.simulate(case, elements=options[0], tolerance=3e-6, until="snap")
        late = history.crossing("height")[1] - fold.angle
        ratio.append(late / delay.predict(fold, rate, damping).angle)
        assert history.stats["steps"] < 8000
    gaps = np.abs(np.array(ratio) - 1.0)
    assert gaps[2] < gaps[1] < gaps[0] < 0.1
    shrink = 10.0**-power
    limit = ratio[2] + (ratio[2] - ratio[1]) * shrink / (1.0 - shrink)
    assert limit == pytest.approx(1.0, abs=0.02)


def test_refusals():
    with pytest.raises(ValueError, match="Lambda"):
        delay.universal(-1.0)
    with pytest.raises(ValueError, match="at least two"):
        delay.product_from_frequencies(np.array([1.0]), np.array([1.0]), 1.1)
