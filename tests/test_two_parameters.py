"""Curves of folds and of pitchforks in two parameters: folds of single scenes, closed forms, symmetries."""

import pickle
from dataclasses import dataclass, replace

import matplotlib.pyplot as plt
import numpy as np
import pytest

import compare
import der
from ribbonfem import (
    Drive,
    FoldCurve,
    OptionError,
    PitchforkCurve,
    Ribbon,
    Scene,
    elastica,
    kirchhoff,
    quasilinear,
)
from ribbonfem.continuation import Linearisation, Steps, first_point, trace
from ribbonfem.continuation.two_parameters import fold_curve_of
from ribbonfem.ends import Ends
from ribbonfem.ends.second_parameter import SecondParameter
from ribbonfem.options import KeywordError

# alpha over the root of dL/L at the fold of small slopes (field of `closed_form`)
MU = quasilinear.closed_form_fold().mu
PATH = Scene(compression=0.40, shear=0.37, start="U+S+")
ARCH = Scene(compression=0.30, shear=0.0, start="U+")
BOTH = Scene(compression=0.20, shear=0.0, start="U+", drive="both")


def at_value(scene, over, value):
    """The scene in which the parameter has a value."""
    if over in ("compression", "shear"):
        return replace(scene, **{over: value})
    return replace(scene, preset={**scene.preset, over: value})


@pytest.fixture(scope="module")
def over_shear():
    """The first fold of U+S+ at dL .30, from beyond its cusp."""
    return kirchhoff.fold_curve(
        Scene(compression=0.30, shear=0.30, start="U+S+"), over="shear", span=(0.0, 0.34)
    )


@pytest.fixture(scope="module")
def first_fold():
    """The first fold of U+S+ at dL .40, over all shears up to .5."""
    return kirchhoff.fold_curve(replace(PATH, shear=0.40), over="shear", span=(0.0, 0.50))


CURVES = [
    (kirchhoff, PATH, "compression", (0.35, 0.45)),
    (kirchhoff, PATH, "shear", (0.35, 0.40)),
    (kirchhoff, PATH, "right", (-0.1, 0.1)),
    (kirchhoff, PATH, "twist_left", (-0.1, 0.04)),
    (kirchhoff, PATH, "lift", (-0.02, 0.02)),
    (kirchhoff, PATH, "force", (-10.0, 10.0)),
    (kirchhoff, replace(PATH, drive="force"), "left", (-0.1, 0.05)),
    (kirchhoff, replace(PATH, drive=Drive(left=1.0, right=0.5)), "shear", (0.36, 0.40)),
    (kirchhoff, replace(PATH, start="U+S-", preset={"left": 0.1}, drive="shear"), "left", (0.05, 0.2)),
    (kirchhoff, replace(PATH, gravity=(0.0, 0.0, -1.0)), "shear", (0.36, 0.40)),
    (elastica, ARCH, "compression", (0.1, 0.5)),
    (elastica, ARCH, "right", (-0.3, 0.3)),
    (elastica, ARCH, "lift", (-0.1, 0.1)),
    (elastica, ARCH, "force", (-3.0, 3.0)),
    (quasilinear, ARCH, "lift", (-0.1, 0.1)),
    (der, PATH, "shear", (0.35, 0.40)),
    (der, PATH, "twist_left", (-0.1, 0.04)),
    (der, replace(PATH, drive="force"), "left", (-0.1, 0.05)),
]


@pytest.mark.parametrize(("model", "scene", "over", "span"), CURVES)
def test_the_curve_has_the_folds_of_its_scenes(model, scene, over, span):
    curve = model.fold_curve(scene, over=over, span=span)
    assert curve.ends == ("span", "span")
    assert curve.stable.all()
    unit = 30.0 if scene.drive == "force" else 1.0
    for share in (0.137, 0.419, 0.871):
        # no row, and no end of a polynomial
        value = span[0] + share * (span[1] - span[0])
        fold = model.folds(at_value(scene, over, value))[0]
        (point,) = curve.at(value)
        assert point.parameter == value
        assert abs(point.control - fold.control) < 1e-9 * unit
        # folds themselves are located to 1e-7 of a step, and less well in what is not stationary
        assert abs(point.height - fold.height) < 1e-7
        assert abs(point.load - fold.load) < 1e-5 * abs(fold.load)


@pytest.mark.parametrize(("model", "options"), [(kirchhoff, {"extensible": True}), (der, {"nodes": 101})])
def test_a_ribbon_ten_times_as_thin(model, options):
    # EI1 / EI2 = 4e4 and EA L^2 / EI2 = 1.2e7: a step's stretch must not be taken for a change of g
    scene = replace(PATH, ribbon=Ribbon(thickness=1e-3), gravity=(0.0, 0.0, 0.0))
    curve = model.fold_curve(scene, over="shear", span=(0.36, 0.39), **options)
    fold = model.folds(replace(scene, shear=0.3812), **options)[0]
    assert abs(curve.at(0.3812)[0].control - fold.control) < 1e-8
    assert curve.stable.all()


def test_which_fold_is_followed():
    curve = kirchhoff.fold_curve(PATH, over="shear", span=(0.36, 0.38), which=1)
    last = kirchhoff.folds(replace(PATH, shear=0.3636))[1]
    assert abs(curve.at(0.3636)[0].control - last.control) < 1e-9


def test_the_curve_of_us_ends_in_cusps_at_its_pitchforks(over_shear, first_fold):
    # at alpha = 0 the ribbon has a symmetry that alpha breaks: it unfolds the pitchforks into cusps
    assert over_shear.cusps[0].parameter == pytest.approx(0.28374248732, abs=2e-11)
    for curve, compression in ((over_shear, 0.30), (first_fold, 0.40)):
        forks = kirchhoff.pitchforks(compression)
        cusps = [cusp for cusp in curve.cusps if abs(cusp.control) < 1e-10]
        expected = (forks.broken, forks.merged)[: len(cusps)]
        assert [cusp.parameter for cusp in cusps] == pytest.approx(expected, abs=1e-10)
    # few rows, and at most a few steps again
    assert len(over_shear) < 120
    # both of them; between lies a cusp that no symmetry makes
    assert len(cusps) == 2
    assert len(first_fold.cusps) == 3


def test_cusps_and_turns_are_where_the_rows_turn_back(first_fold):
    # of the polynomials through the rows, which know nothing of the second derivatives along the null vector
    marks = [*first_fold.cusps, *first_fold.turns]
    found = []
    for parameters, controls, *_ in first_fold.pieces:
        begin, end = parameters.domain
        for place in parameters.deriv().roots():
            if abs(place.imag) == 0.0 and begin <= place.real <= end:
                found.append((parameters(place.real), controls(place.real)))
    assert len(found) == len(marks) == 6
    for parameter, control in found:
        near = min(marks, key=lambda mark: abs(mark.parameter - parameter))
        assert abs(near.parameter - parameter) < 1e-9
        assert abs(near.control - control) < 1e-7


def test_a_cusp_is_a_semicubical_parabola(over_shear):
    cusp = over_shear.cusps[0]
    near = np.array([1e-5, 2e-5])
    one, other = np.array([[point.control for point in over_shear.at(cusp.parameter + d)] for d in near]).T
    # its two branches are as far apart as the power 3/2 of the distance
    apart = np.abs(one - other)
    assert np.log2(apart[1] / apart[0]) == pytest.approx(1.5, abs=2e-3)
    assert len(over_shear.at(cusp.parameter)) == 1
    with pytest.raises(OptionError, match=r"parameter = 0\.28: shear of the curve is in \[0\.28374248"):
        over_shear.at(0.28)


def test_beyond_the_cusp_are_folds_too(over_shear, first_fold):
    for curve, shear in ((over_shear, 0.305), (first_fold, 0.35)):
        scene = replace(curve.scene, shear=shear)
        folds = [fold.control for fold in kirchhoff.equilibria(scene, span=(-1.5, 1.5)).folds]
        for point in curve.at(shear):
            # of the other half the curve of equilibria through U+S+ has those that are near
            if abs(point.control) < 0.2:
                assert min(abs(fold - point.control) for fold in folds) < 1e-9


def test_an_isola_is_born_and_joined_at_the_turns(first_fold):
    turns = [turn for turn in first_fold.turns if turn.control < 0.0]
    born, joined = sorted(turns, key=lambda turn: turn.parameter)
    assert born.kind == joined.kind == "turn"
    counts = [
        sum(point.control < 0.0 for point in first_fold.at(turn.parameter + side))
        for turn in (born, joined)
        for side in (-1e-6, 1e-6)
    ]
    assert counts[1] - counts[0] == 2
    assert counts[3] - counts[2] == -2
    # at shear .40 the isola is about alpha -1.28 to -.66 (a continuation that jumps onto it by mistake)
    low, high = sorted(point.control for point in first_fold.at(0.40) if point.control < -0.6)
    assert low < -1.25
    assert -0.68 < high < -0.6


def test_the_planar_fold_is_even_in_the_shear():
    curve = kirchhoff.fold_curve(replace(ARCH, compression=0.40), over="shear", span=(-0.2, 0.2))
    for shear in (0.07, 0.19):
        assert curve.at(shear)[0].control == pytest.approx(curve.at(-shear)[0].control, abs=1e-9)
    assert curve.at(0.0)[0].control == pytest.approx(1.1230897421, abs=1e-9)


def test_small_slopes_scale_with_the_root_of_the_compression():
    curve = quasilinear.fold_curve(ARCH, over="compression", span=(0.01, 0.5))
    forks = quasilinear.pitchfork_curve(BOTH, over="compression", span=(0.01, 0.3))
    for compression in (0.0123, 0.0789, 0.29):
        root = compression**0.5
        assert curve.at(compression)[0].control == pytest.approx(MU * root, abs=2e-9)
        assert forks.at(compression)[0].control == pytest.approx(2.0 * root, abs=2e-9)


def test_the_elastica_goes_to_small_slopes_as_dl():
    curve = elastica.fold_curve(ARCH, over="compression", span=(0.005, 0.3))
    forks = elastica.pitchfork_curve(BOTH, over="compression", span=(0.005, 0.3))
    for result, mu in ((curve, MU), (forks, 2.0)):
        off = [result.at(dL)[0].control / dL**0.5 / mu - 1.0 for dL in (0.006, 0.012, 0.024)]
        # an error O(dL), and of the next order what is left of the ratio
        assert off[1] / off[0] == pytest.approx(2.0, abs=0.03)
        assert off[2] / off[1] == pytest.approx(2.0, abs=0.06)
        assert 0.0 < off[0] < 1e-3


def test_both_clamps_have_their_pitchfork_by_other_ways():
    curve = elastica.pitchfork_curve(BOTH, over="compression", span=(0.03, 0.25))
    assert [curve.at(dL)[0].control / dL**0.5 for dL in (0.10, 0.20)] == pytest.approx(
        [2.0192, 2.0385], abs=5e-5
    )
    for angle, remaining in ((0.6, 0.0884939107), (0.4, 0.039699033)):
        # by shooting: clamps kept, the compression falling; ten digits of that are 4e-10 of the angle
        assert curve.at(remaining)[0].control == pytest.approx(angle, abs=5e-9)
        kept = replace(ARCH, drive="compression", rate=-0.1, preset={"left": angle, "right": angle})
        (lost,) = elastica.instabilities(kept)
        assert curve.at(0.30 + lost.control)[0].control == pytest.approx(angle, abs=1e-8)
        # the other control moves, the other is the parameter
        other = elastica.pitchfork_curve(kept, over="both", span=(angle - 0.1, angle + 0.1))
        value = angle + 0.05
        there = 0.30 + other.at(value)[0].control
        assert curve.at(there)[0].control == pytest.approx(value, abs=1e-8)


def test_a_pitchfork_of_the_ribbon_is_that_of_the_beam_until_it_leaves_its_plane():
    planar = elastica.pitchfork_curve(BOTH, over="compression", span=(0.10, 0.30))
    curve = kirchhoff.pitchfork_curve(BOTH, over="compression", span=(0.10, 0.30))
    assert isinstance(curve, PitchforkCurve)
    assert planar.stable.all()
    np.testing.assert_allclose(
        [curve.at(dL)[0].control for dL in (0.11, 0.19, 0.28)],
        [planar.at(dL)[0].control for dL in (0.11, 0.19, 0.28)],
        atol=1e-8,
    )
    # beyond it the state that forks has lost its stability out of the plane before
    for compression in (0.28, 0.30):
        (lost,) = kirchhoff.instabilities(replace(BOTH, compression=compression))
        row = int(np.argmin(np.abs(curve.parameter - compression)))
        assert curve.stable[row] == (not lost.out_of_plane)
        before = curve.at(compression)[0].control - lost.control
        assert abs(before) < 1e-8 if curve.stable[row] else before > 1e-4


def test_out_of_the_plane_and_by_twist():
    scene = replace(BOTH, compression=0.40)
    curve = kirchhoff.pitchfork_curve(scene, over="compression", span=(0.35, 0.45))
    assert curve.at(0.40)[0].control == pytest.approx(1.211826175, abs=1e-9)
    (lost,) = kirchhoff.instabilities(replace(scene, compression=0.37))
    assert curve.at(0.37)[0].control == pytest.approx(lost.control, abs=1e-8)
    twisted = kirchhoff.pitchfork_curve(
        replace(ARCH, drive="twist_left"), over="compression", span=(0.25, 0.35)
    )
    (lost,) = kirchhoff.instabilities(replace(ARCH, drive="twist_left", compression=0.333))
    assert twisted.at(0.333)[0].control == pytest.approx(lost.control, abs=1e-8)
    with pytest.raises(
        OptionError, match=r"which = 0: the state is lost out of its plane, at alpha 1\.21183"
    ):
        elastica.pitchfork_curve(scene, over="compression", span=(0.35, 0.45))


def test_rods_go_to_the_elements_as_their_edge_squared():
    scene, span = Scene(compression=0.30, shear=0.30, start="U+S+"), (0.27, 0.31)
    exact = kirchhoff.fold_curve(scene, over="shear", span=span, extensible=True)
    rods = [der.fold_curve(scene, over="shear", span=span, nodes=nodes) for nodes in (52, 102)]
    for measure in (
        lambda curve: curve.cusps[0].parameter,
        lambda curve: max(point.control for point in curve.at(0.295)),
        lambda curve: min(point.control for point in curve.at(0.295)),
    ):
        coarse, fine = (measure(curve) - measure(exact) for curve in rods)
        # edges of L/50 and L/100
        assert coarse / fine == pytest.approx(4.0, rel=0.05)
    assert abs(rods[1].cusps[0].parameter - exact.cusps[0].parameter) < 5e-4
    assert abs(rods[0].cusps[0].control) < 1e-9


def test_rods_have_the_pitchfork_too():
    curve = der.pitchfork_curve(BOTH, over="compression", span=(0.15, 0.25), nodes=101)
    (lost,) = der.instabilities(replace(BOTH, compression=0.18), nodes=101)
    assert curve.at(0.18)[0].control == pytest.approx(lost.control, abs=1e-8)


def test_what_is_claimed_between_rows_holds(first_fold):
    # of other rows the polynomials are others
    shorter = kirchhoff.fold_curve(
        first_fold.scene,
        over="shear",
        span=(0.36, 0.44),
        steps=Steps(first=0.007, largest=0.05, turn=0.2),
    )
    for shear in np.linspace(0.361, 0.439, 7):
        (point,) = shorter.at(shear)
        off = min(abs(other.control - point.control) for other in first_fold.at(shear))
        assert off < 2.0 * (first_fold.error + shorter.error)
    assert first_fold.error < 1e-8


@dataclass(frozen=True)
class Number:
    u: float
    at: float = 0.0


class Circle:
    """u^2 + p^2 + q^2 = 1, with p the left angle and q the compression beyond a half, in .3 L.

    Its folds, u = 0, are a circle in the plane of p and q.
    """

    weight, parameter_weight = np.ones(1), 0.0225

    def __init__(self, ends):
        self.ends = ends

    def along(self, ends):
        return Circle(ends)

    def linearise(self, state, parameter):
        left, compression = self.ends.controls(parameter)[[0, 4]]
        q, moved = compression / 0.3, self.ends.moved
        slope = 2.0 * left * moved[0] + 2.0 * q / 0.3 * moved[4]
        # (a pivot is never 0)
        tangent = np.copysign(max(abs(2.0 * state.u), 1e-16), state.u)
        value = state.u**2 + left**2 + q**2 - 1.0
        return Linearisation(
            np.array([value]), np.array([slope]), lambda right: right / tangent, int(tangent < 0.0)
        )

    def advance(self, state, increment, parameter):
        return Number(state.u + float(increment[0]), parameter)

    def observe(self, state, parameter):
        return state.u, 0.0, parameter

    def positions(self, state, parameter):
        return np.array([[state.u, parameter, float(self.ends.controls(0.0)[4])]])

    def energy(self, state):
        return 0.0


def test_a_curve_that_closes_is_followed_once():
    scene = Scene(compression=0.5, shear=0.0, start="U+")
    problem = Circle(Ends.of(scene))
    first = first_point(problem, Number(0.9), 0.3, 1.0)
    event = next(segment.events[0] for segment in trace(problem, first, (-3.0, 2.0)) if segment.events)
    assert event.kind == "fold"
    parameter = SecondParameter.of(scene, "compression", (0.1, 0.9))
    of = {"model": "circle", "options": {}}
    curve = fold_curve_of(problem, [event], 0, scene, parameter, Steps(), **of)
    assert curve.ends == ("closed", "closed")
    assert curve.cusps == ()
    for compression in (0.21, 0.37, 0.5, 0.66):
        far = (1.0 - ((compression - 0.5) / 0.3) ** 2) ** 0.5
        found = sorted(point.control for point in curve.at(compression))
        if compression == 0.5:
            # where it begins and ends, twice
            found = [found[0], found[-1]]
        assert found == pytest.approx([-far, far], abs=2e-9)
    turns = sorted(turn.parameter for turn in curve.turns)
    assert turns == pytest.approx([0.2, 0.8], abs=1e-12)
    assert [turn.control for turn in curve.turns] == pytest.approx([0.0, 0.0], abs=1e-6)


def test_a_span_may_begin_or_end_at_the_scene():
    scene = replace(PATH, shear=0.38)
    whole = kirchhoff.fold_curve(scene, over="shear", span=(0.36, 0.40))
    for span in ((0.36, 0.38), (0.38, 0.40)):
        part = kirchhoff.fold_curve(scene, over="shear", span=span)
        assert (part.parameter.min(), part.parameter.max()) == pytest.approx(span, abs=1e-9)
        value = 0.5 * sum(span)
        assert part.at(value)[0].control == pytest.approx(whole.at(value)[0].control, abs=1e-9)
    # the scene's own fold is a row
    row = list(whole.parameter).index(0.38)
    assert abs(whole.control[row] - kirchhoff.folds(scene)[0].control) < 1e-10


REFUSED = [
    ({"over": "alpha"}, r"over = 'alpha': must be one of 'right', "),
    ({"over": 3}, r"over = 3: must be one of"),
    ({"over": "left"}, r"over = 'left': the drive moves that; there are 'right', "),
    ({"over": "both"}, r"over = 'both': the drive moves that"),
    ({"span": 0.3}, r"span = 0\.3: must be a pair of finite numbers"),
    ({"span": (0.4, 0.3)}, r"span = \(0\.4, 0\.3\): must be a pair of numbers, the first one lower"),
    ({"span": (0.38, 0.39)}, r"span = \(0\.38, 0\.39\): must have 0\.37 in it, the scene's own shear"),
    ({"span": (0.3, 0.9)}, r"span = \(0\.3, 0\.9\): at shear = 0\.9 the right clamp would be at"),
    ({"over": "compression", "span": (0.01, 0.5)}, r"at compression = 0\.01 the right clamp would be"),
    ({"which": -1}, r"which = -1: must be a whole number of at least 0"),
    ({"which": 2}, r"which = 2: the scene has 2 folds, so that there is from 0 to 1"),
]


@pytest.mark.parametrize(("given", "message"), REFUSED)
def test_what_cannot_be_is_said(given, message):
    with pytest.raises(OptionError, match=message):
        kirchhoff.fold_curve(PATH, **{"over": "shear", "span": (0.36, 0.38), **given})


def test_planar_models_and_symmetry_say_what_they_lack():
    with pytest.raises(OptionError, match=r"over = 'shear': it leaves the plane of this model; there are"):
        elastica.fold_curve(ARCH, over="shear", span=(-0.1, 0.1))
    for model in (elastica, kirchhoff, der, quasilinear):
        with pytest.raises(OptionError, match=r"over = 'lift': unfolds the pitchfork"):
            model.pitchfork_curve(BOTH, over="lift", span=(-0.1, 0.1))
    with pytest.raises(OptionError, match=r"which = 0: the scene has 0 pitchforks"):
        kirchhoff.pitchfork_curve(PATH, over="shear", span=(0.36, 0.38))
    with pytest.raises(OptionError, match=r"over = 'both': has no one value with preset"):
        kirchhoff.fold_curve(
            replace(PATH, drive="force", preset={"left": 0.05}), over="both", span=(0.0, 0.1)
        )
    with pytest.raises(KeywordError, match=r"kirchhoff\.fold_curve: .*'over'"):
        kirchhoff.fold_curve(PATH, span=(0.36, 0.38))


def test_a_curve_is_a_result(over_shear, tmp_path):
    assert isinstance(over_shear, FoldCurve)
    assert compare.load(compare.save(over_shear, tmp_path / "curve.result")) == over_shear
    assert pickle.loads(pickle.dumps(over_shear)) == over_shear
    assert compare.load(tmp_path / "curve.result").at(0.30)[0].control == over_shear.at(0.30)[0].control
    with pytest.raises(ValueError, match="read-only"):
        over_shear.control[0] = 0.0
    assert over_shear.angle is over_shear.control
    assert "cusp at shear 0.283742487, alpha 0 rad" in repr(over_shear)
    assert "<td>cusp</td>" in over_shear._repr_html_()
    frame = over_shear.to_pandas()
    assert list(frame.columns) == ["parameter", "angle", "height", "load", "stable", "arclength"]
    assert frame.attrs["units"]["parameter"] == "L"
    assert frame.attrs["cusps"] == [over_shear.cusps[0].parameter]
    assert over_shear.to_xarray()["parameter"].attrs["units"] == "L"
    axes = over_shear.plot(label="U+S+")
    assert axes.get_xlabel() == "$dW/L$"
    assert axes.get_ylabel() == r"$\alpha$ (rad)"
    # what is drawn goes through the cusp
    drawn = np.concatenate([line.get_xydata() for line in axes.lines])
    assert np.hypot(*(drawn - (over_shear.cusps[0].parameter, 0.0)).T).min() < 1e-6
    plt.close(axes.figure)
