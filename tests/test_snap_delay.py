"""Delays to the next order: the normal form's cubic term, the escape from the fold, and what they predict."""

import math
from dataclasses import replace
from time import process_time

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import der
from ribbonfem import (
    OptionError,
    Ribbon,
    Scene,
    SceneError,
    Schedule,
    delay,
    elastica,
    kirchhoff,
    quasilinear,
)
from ribbonfem.delay.cubic import _outer_cubic
from ribbonfem.delay.universal_curve import _outer

PLANAR = Scene(compression=0.4, shear=0.0, start="U+", rate=0.1, damping=0.0)
PATH_1 = replace(PLANAR, shear=0.37, start="U+S-")
PATH_2 = replace(PLANAR, shear=0.37, start="U+S+")
WIDE = {"extensible": True}


@pytest.mark.parametrize("damping", [0.0, 0.3, 1.0, 3.0])
def test_cubic_curve_against_plain_integration(damping):
    """Times at a given a of two small cubic terms, less what grows; what is left falls as a^(-1/2)."""

    def time(cubic, a):
        def end(t, y):
            return y[0] - a

        end.terminal = True
        start = np.array(_outer(1.0, damping, 30.0)) + cubic * np.array(_outer_cubic(1.0, damping, 30.0))
        run = solve_ivp(
            lambda t, y: (y[1], t + y[0] ** 2 + cubic * y[0] ** 3 - damping * y[1]),
            (-30.0, 20.0),
            start,
            events=end,
            method="DOP853",
            rtol=1e-12,
            atol=1e-13,
        )
        return run.t_events[0][0]

    finite = []
    for a in (1e3, 4e3):
        small = 1e-3 / a
        shift = (time(small, a) - time(-small, a)) / (2 * small)
        finite.append(shift + 0.5 * 1.5**1.5 * a**0.5 + 18 / 35 * damping * math.log(a))
    assert 2 * finite[1] - finite[0] == pytest.approx(delay.cubic_curve(damping), abs=6e-3)


def test_cubic_curve_joins_its_logarithm():
    """Friction alone: 1/3 of the logarithm of the rate is left, 67/105 of that of Lambda."""
    values = [delay.cubic_curve(x) / x for x in (3e3, 9.9e3, 1.01e4, 3e5)]
    slope = [
        (b - a) / math.log(y / x) for a, b, x, y in ((*values[:2], 3e3, 9.9e3), (*values[2:], 1.01e4, 3e5))
    ]
    assert slope == pytest.approx([-67 / 105] * 2, abs=2e-3)
    assert values[1] - values[2] == pytest.approx(67 / 105 * math.log(1.01 / 0.99), rel=0.02)


@pytest.mark.parametrize("damping", [0.0, 1.0, 50.0])
def test_escape_time_against_plain_integration(damping):
    """From y to twice y the escapes' times differ by the time that the equation takes."""
    y, cubic = 10.0, -1e-6
    ends = [delay.escape_time(k * y, damping, cubic) for k in (1.0, 2.0)]

    def there(t, u):
        return u[0] - 2.0 * y

    there.terminal = True
    run = solve_ivp(
        lambda t, u: (u[1], u[0] ** 2 + cubic * u[0] ** 3 - damping * u[1]),
        (0.0, 100.0),
        (y, ends[0].speed),
        events=there,
        method="Radau",
        rtol=1e-11,
        atol=1e-12,
    )
    assert run.y_events[0][0][1] == pytest.approx(ends[1].speed, rel=1e-7)
    # the two finite parts count from their own y: both leave out the same infinite one
    assert run.t_events[0][0] == pytest.approx(ends[0].time - ends[1].time, rel=1e-6)


def test_undamped_escape_in_closed_form():
    """y'^2 = 2/3 y^3 + gamma y^4 / 2, and the integral of its inverse."""
    result = delay.escape_time(24.0, 0.0, 1e-3)
    assert result.speed == pytest.approx(math.sqrt(2 / 3 * 24.0**3 + 0.5e-3 * 24.0**4), rel=1e-9)
    # 1/y' = sqrt(3/2) (y^(-3/2) - 3/8 gamma y^(-1/2)): the second has the finite part + 3/4 gamma y^(1/2)
    exact = math.sqrt(1.5) * (2.0 / math.sqrt(24.0) + 0.75e-3 * math.sqrt(24.0))
    assert result.time == pytest.approx(exact, rel=1e-8)


def test_coefficients_of_the_models_agree():
    """gamma and beta by models that share neither unknowns nor amplitudes, and under a mirror."""
    beam = elastica.normal_forms(PLANAR, elements=16, **WIDE)[0]
    ribbon = kirchhoff.normal_forms(PLANAR, elements=12, **WIDE)[0]
    rods = [der.normal_forms(PLANAR, nodes=n)[0] for n in (76, 151)]
    down = elastica.normal_forms(replace(PLANAR, start="U-", rate=-0.1), elements=16, **WIDE)[0]
    for name in ("quadratic", "cubic", "mixed"):
        coarse, fine = (getattr(rod, name) for rod in rods)
        limit = fine + (fine - coarse) / (149**2 / 74**2 - 1)
        assert getattr(ribbon, name) == pytest.approx(getattr(beam, name), rel=3e-4)
        assert limit == pytest.approx(getattr(beam, name), rel=1e-3)
        assert getattr(down, name) == pytest.approx(getattr(beam, name), rel=1e-6)


def test_coefficients_do_not_show_their_reach(monkeypatch):
    result = []
    for reach in (4e-3, 2e-3):
        monkeypatch.setattr("ribbonfem.delay.normal_forms._REACH", reach)
        result.append(elastica.normal_forms(PLANAR, elements=16)[0])
    assert result[0].cubic == pytest.approx(result[1].cubic, rel=1e-3)
    assert result[0].mixed == pytest.approx(result[1].mixed, rel=1e-3)


def test_momentum_of_a_turning_clamp():
    """The clamp's motion alone, seen by a mode, is the work of the mass on the positions that it moves."""
    problem = kirchhoff.functions.states.named(PATH_1, elements=8, extensible=True)[0]
    frames = kirchhoff.functions.states.named(PATH_1, elements=8, extensible=True)[1]
    mode = np.cos(1.0 + np.arange(len(problem.weight)))
    mode[:-3] *= 1e-2
    step = 1e-5
    zero = np.zeros_like(mode)
    turned = [problem.positions(problem.advance(frames, zero, side * step), 0.0) for side in (-1, 1)]
    by_clamp = (turned[1] - turned[0]) / (2 * step)
    by_mode, _ = problem.moving(frames, mode)
    expected = float(problem.mass @ np.sum(by_clamp * by_mode, axis=1))
    assert mode @ problem.momentum(frames, zero, 1.0) == pytest.approx(expected, rel=1e-6)


def test_escape_starts_where_it_says():
    """At the fold's angle, of that amplitude in the norm of the mass, as fast as the normal form."""
    form = kirchhoff.normal_forms(PATH_1)[0]
    history = kirchhoff.escape(PATH_1, amplitude=2e-3, until="snap")
    speed = delay.escape_time(2e-3 * form.quadratic, 0.0, form.cubic).speed / form.quadratic
    unit = Ribbon().inertial_time
    assert history.angle == pytest.approx(np.full(len(history), form.angle), abs=1e-12)
    assert history.energies["kinetic"][0] == pytest.approx(0.5 * (speed * unit) ** 2, rel=2e-3)
    energy = sum(history.energies[k] for k in ("kinetic", "elastic", "dissipated"))
    assert energy - history.energies["work"] == pytest.approx(energy[0], abs=2e-4)


@pytest.mark.parametrize(("model", "mesh"), [(kirchhoff, {"elements": 4}), (der, {"nodes": 31})])
def test_an_escape_until_its_normal_form_ends_begins_as_the_whole(model, mesh):
    form = model.normal_forms(PATH_2, **mesh)[0]
    whole, part = (
        model.escape(PATH_2, amplitude=8e-3, until=until, **mesh) for until in ("end", "normal form")
    )
    assert part.time[-1] == pytest.approx(delay.escape_time(8e-3 * form.quadratic, 0.0, form.cubic).time)
    assert np.array_equal(part.height[:-2], whole.height[: len(part) - 2])
    assert part.crossing("slope") == whole.crossing("slope") is not None


def test_lead_shows_neither_amplitude_nor_mesh():
    """T0 of the planar ribbon: .0863 s whatever the push; of beam, elements and rods the same to 1e-3."""
    result = []
    for y in (4.0, 30.0):
        form = elastica.normal_forms(PLANAR, elements=16)[0]
        history = elastica.escape(PLANAR, amplitude=y / form.quadratic, elements=16, until="snap")
        result.append(delay.escape_time(y, 0.0, form.cubic).time - history.crossing()[0])
    assert result[0] == pytest.approx(result[1], abs=6e-4)
    beam, ribbon = delay.lead(elastica, PLANAR, **WIDE)[1], delay.lead(kirchhoff, PLANAR, **WIDE)[1]
    rods = [delay.lead(der, PLANAR, nodes=n)[1].time for n in (76, 151)]
    assert beam.time == pytest.approx(0.0864, abs=3e-4)
    assert ribbon.time == pytest.approx(beam.time, abs=3e-4)
    assert rods[1] + (rods[1] - rods[0]) / 3 == pytest.approx(beam.time, abs=5e-4)


@pytest.mark.parametrize(
    ("scene", "quantity", "limit"), [(PATH_1, "snap", 0.1433), (PATH_2, "first snap", 0.1951)]
)
def test_lead_of_ribbons(scene, quantity, limit):
    """Field measurements at the slowest rates tend to .145 and .196 s, from above."""
    ribbon = delay.lead(kirchhoff, scene, 0, quantity, **WIDE)[1]
    rods = [delay.lead(der, scene, 0, quantity, nodes=n)[1].time for n in (52, 102)]
    assert ribbon.time == pytest.approx(limit, abs=6e-4)
    assert rods[1] + (rods[1] - rods[0]) / 3 == pytest.approx(ribbon.time, abs=1e-3)


def measured(model, scene, quantity, form, **options):
    """Time from the fold to the snap on the ramp itself, s."""
    first = delay.predict(form, scene.rate, scene.damping)
    until = "snap" if quantity == "snap" else "end"
    stop = form.angle + 1.2 * first.angle + 0.3 * scene.rate
    history = model.simulate(replace(scene, stop=stop), until=until, **options)
    crossing = history.crossing("height" if quantity == "snap" else "slope")
    return crossing[0] - form.angle / scene.rate


CELLS = [
    (quasilinear, PLANAR, "snap", 1e-3, 0.1, 0.02),
    (elastica, PLANAR, "snap", 1e-3, 0.1, 0.02),
    (elastica, PLANAR, "snap", 10.0, 0.1, 0.02),
    (elastica, PLANAR, "snap", 1e3, 1e-2, 0.02),
    (kirchhoff, PATH_1, "snap", 1.0, 0.1, 0.02),
    (kirchhoff, PATH_1, "snap", 10.0, 0.1, 0.02),
    (kirchhoff, PATH_2, "first snap", 1.0, 1e-2, 0.02),
]


@pytest.mark.parametrize(("model", "scene", "quantity", "damping", "rate", "within"), CELLS)
def test_prediction_to_the_next_order(model, scene, quantity, damping, rate, within):
    """Measured over predicted within 2 %, where the leading order is off by up to 30 %; the error covers."""
    scene = replace(scene, damping=damping, rate=rate)
    form = model.normal_forms(scene)[0]
    time = measured(model, scene, quantity, form, tolerance=1e-6)
    result = delay.predict_snap(model, scene, quantity)
    assert time / result.time == pytest.approx(1.0, abs=within)
    assert abs(time - result.time) < result.error
    assert abs(time - result.time) < 0.5 * abs(time - delay.predict(form, rate, damping).time)
    assert result.angle == rate * result.time


# strongly damped, between the values of the other tests
STRONG = [
    (elastica, replace(PLANAR, compression=0.3), (30.0, 300.0, 7000.0), {}),
    (kirchhoff, replace(PATH_1, compression=0.37, shear=0.36), (65.0, 3000.0), {}),
    (der, replace(PATH_1, compression=0.36, shear=0.36), (280.0, 650.0), {"nodes": 31}),
]


@pytest.mark.parametrize(("model", "scene", "dampings", "mesh"), STRONG)
def test_error_where_damping_is_strong(model, scene, dampings, mesh):
    """The error covers the true one at every damping and rate, and is at most five times it in the median."""
    shares = []
    for damping in dampings:
        for rate in (1e-4, 1e-2, 0.1):
            ramp = replace(scene, damping=damping, rate=rate)
            form, lead = delay.lead(model, ramp, **mesh)
            result = delay.next_order(form, lead, rate, damping)
            time = measured(model, ramp, "snap", form, tolerance=1e-7, **mesh)
            shares.append(result.time_error / abs(time - result.time))
            assert 0.0 <= result.time <= 1.1 * delay.predict(form, rate, damping).time
    assert min(shares) > 1.0
    assert np.median(shares) < 5.0


def test_every_damping_is_answered_at_once():
    """Seeded, nu from 0 to 1e4: a snap is predicted within 5 s of CPU, what is of the normal form in .5 s."""
    generator = np.random.default_rng(5)
    for damping in (0.0, 300.0, 800.0, 1e4):
        begun = process_time()
        result = delay.predict_snap(elastica, replace(PLANAR, compression=0.3, damping=damping))
        assert process_time() - begun < 5.0
        assert result.error == result.time_error
        assert result.angle_error == pytest.approx(0.1 * result.time_error, rel=1e-12)
    for _ in range(12):
        lag, y = 10 ** generator.uniform(-8.0, 6.0), 10 ** generator.uniform(-6.0, 6.0)
        begun = process_time()
        assert delay.universal(lag) > 2.3 * max(1.0, lag ** (2 / 3))
        assert math.isfinite(delay.cubic_curve(lag))
        assert delay.escape_time(y, lag, -0.05 / y).speed > 0.0
        assert process_time() - begun < 0.5


def test_what_is_left_out_falls_as_it_is_said_to():
    """tau^-3: by 10^0.6 a decade of the rate (and the uncertainty of T0 at the slow end)."""
    scene = replace(PLANAR, damping=10.0)
    form, lead = delay.lead(elastica, scene, elements=16, tolerance=1e-7)
    gaps = []
    for rate in (0.03, 0.3):
        time = measured(elastica, replace(scene, rate=rate), "snap", form, elements=16, tolerance=1e-7)
        gaps.append(time - delay.next_order(form, lead, rate, 10.0).time)
    assert math.log10(gaps[1] / gaps[0]) == pytest.approx(0.6, abs=0.15)


def test_refusals():
    with pytest.raises(OptionError, match="quantity"):
        delay.predict_snap(elastica, PLANAR, "third snap")
    with pytest.raises(OptionError, match="fold = 1"):
        elastica.escape(PLANAR, fold=1)
    with pytest.raises(OptionError, match="amplitude"):
        elastica.escape(PLANAR, amplitude=0.2)
    assert math.isinf(delay.predict(elastica.normal_forms(PLANAR)[0], 0.1, 1.0).error)


# each with its start and what is asked of it
SYSTEMS = [
    (quasilinear, "U+", "snap"),
    (elastica, "U+", "snap"),
    (kirchhoff, "U+", "snap"),
    (kirchhoff, "U+S-", "snap"),
    (kirchhoff, "U+S+", "first snap"),
]


def drawn(generator, start):
    """A scene at random; its start need not be stable."""
    compression = generator.uniform(0.1, 0.45)
    thickness = 10 ** generator.uniform(math.log10(0.004), math.log10(0.02))
    rate, damping = 10 ** generator.uniform(-4.0, 0.0), 10 ** generator.uniform(-3.0, 3.0)
    shear = compression * generator.uniform(0.9, 1.1) if len(start) > 2 else 0.0
    ribbon = Ribbon(thickness=thickness)
    return Scene(compression=compression, shear=shear, start=start, rate=rate, damping=damping, ribbon=ribbon)


@pytest.mark.slow
def test_error_covers_random_scenes():
    """100 scenes: covered in 95 %, and by less than a factor of 5 in the median."""
    generator = np.random.default_rng(13)
    shares = []
    while len(shares) < 100:
        model, start, quantity = SYSTEMS[len(shares) % len(SYSTEMS)]
        scene = drawn(generator, start)
        try:
            forms = model.normal_forms(scene)
        except ValueError:
            # the start is not stable there
            continue
        if len(forms) < (2 if start == "U+S+" else 1):
            continue
        result = delay.predict_snap(model, scene, quantity)
        # a slow ramp at 1e-6 is itself as far off as its prediction
        time = measured(model, scene, quantity, forms[0], tolerance=1e-8)
        shares.append(result.error / abs(time - result.time))
    assert np.mean(np.array(shares) >= 1.0) >= 0.95
    assert 1.0 < np.median(shares) < 5.0


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"ribbon": Ribbon(retardation=0.02), "gravity": (0, 0, 0)}, r"Ribbon\.retardation = 0\.02"),
        ({"schedule": Schedule((0, 10), (0, 1.5))}, r"Scene\.schedule"),
    ],
)
def test_what_the_normal_form_knows_nothing_of_is_refused(change, named):
    """The friction of a material makes a slow snap late by several times what the damping does."""
    with pytest.raises(SceneError, match=named):
        delay.predict_snap(elastica, Scene(compression=0.4, shear=0.0, start="U+", **change))
