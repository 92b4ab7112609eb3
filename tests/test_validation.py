"""Whatever a function gets, it answers, or refuses in a sentence with field, value and what is allowed."""

import datetime
import inspect
import math
import warnings
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from typing import get_type_hints

import numpy as np
import pytest

import der
import ribbonfem
from compare.chooser.choice import choose
from compare.quantities.convergence import convergence
from compare.report.registry import ORDER, named
from compare.sweep import Sweep
from ribbonfem import (
    OptionError,
    Ribbon,
    Scene,
    SceneError,
    SceneWarning,
    SolverError,
    delay,
    elastica,
    kirchhoff,
    quasilinear,
)
from ribbonfem.continuation import Steps
from ribbonfem.options import KeywordError, checked, options_given

PLANAR = Scene(compression=0.4, shear=0.0, start="U+", rate=1.0, stop=0.1)
PATH_1 = Scene(compression=0.4, shear=0.37, start="U+S-", rate=1.0, stop=0.1)
PATH_2 = Scene(compression=0.4, shear=0.40, start="U+S+", rate=1.0, stop=0.1)
NO_NUMBERS = [
    "1",
    "",
    b"x",
    [],
    [1],
    (1,),
    ("-1", "1"),
    {},
    {"a": 1},
    set(),
    np.array(1.0),
    np.array([1.0, 2.0]),
    np.zeros((3, 3)),
    np.timedelta64(1, "s"),
    np.datetime64("2020-01-01"),
    datetime.timedelta(1),
    Decimal("0.1"),
    1j,
    object(),
    int,
    len,
    range(3),
    "x" * 5000,
    Ribbon(),
]
NO_FINITE = [10**400, -(10**400), math.nan, math.inf, -math.inf, Fraction(10**400), np.longdouble("1e4000")]
EXTREME = [0, -1, -0.0, 5e-324, 1e-300, 1e-30, 1e300, 10**20, 10**9, -(10**9), (-1e300, 1e300), (1, -1)]
BAD = [*NO_NUMBERS, *NO_FINITE, *EXTREME, None, True, 0.1, Fraction(1, 10), Steps]
FUNCTIONS = [
    (model, name, scene)
    for model, scene in (
        (quasilinear, PLANAR),
        (elastica, PLANAR),
        (kirchhoff, PATH_1),
        (der, PATH_1),
        (der, PLANAR),
    )
    for name in model.__all__
    if inspect.isfunction(getattr(model, name)) and not name.startswith("closed_form")
]


def one_sentence(error, *words):
    text = str(error)
    assert "\n" not in text
    assert len(text) < 700, text
    for word in words:
        assert word in text, text


def refused(function, given):
    try:
        function(**given)
    except (SceneError, OptionError, SolverError) as error:
        return error
    return None


@pytest.mark.parametrize(("model", "name", "scene"), FUNCTIONS, ids=lambda v: getattr(v, "__name__", None))
def test_every_keyword_of_every_function(model, name, scene):
    function = getattr(model, name)
    taken = inspect.signature(function).parameters
    small = {"scene": PATH_2 if name in ("saddle", "skipping_bound") else scene, "compression": 0.4}
    small |= {
        "angle": 0.05,
        "nodes": 21 if scene.planar else 31,
        "elements": 16 if model is kirchhoff and name != "escape" else 6,
    }
    if name == "escape":
        # what is taken is run: roughly, and no further than is asked for
        small |= {"tolerance": 1e-3, "until": "snap"}
    given = {key: value for key, value in small.items() if key in taken}
    if name == "leaves_plane" and not scene.planar:
        pytest.skip("of planar scenes")
    for key in (*taken, "bogus"):
        for value in BAD:
            refusal = refused(function, {**given, key: value})
            if refusal is None:
                assert key != "bogus"
                numeric = isinstance(value, (int, float, Fraction, np.floating, tuple, type(None)))
                assert numeric or key == "ribbon", f"{name}({key}={value!r}) was taken"
                assert not isinstance(value, (int, float)) or math.isfinite(value)
            elif isinstance(refusal, SolverError):
                one_sentence(refusal)
                assert key in ("step", "tolerance", "angle", "span"), (key, value, refusal)
            else:
                one_sentence(refusal, key)


# of those values, the ones that these fields may have
MAY_BE = {
    **dict.fromkeys(("stop", "bending_ratio", "twist_ratio", "schedule"), (type(None),)),
    **dict.fromkeys(("curvature", "twist"), (np.ndarray,)),
    "gravity": (type(None), range),
    "preset": (type(None), dict),
    "ribbon": (Ribbon,),
}


@pytest.mark.parametrize("owner", [Ribbon, Scene])
def test_every_field_of_scene_and_ribbon(owner):
    ratios = ["bending_ratio", "twist_ratio"] if owner is Ribbon else []
    for item in (*owner.__dataclass_fields__, *ratios):
        for value in (*NO_NUMBERS, *NO_FINITE, None, True):
            shape = np.shape(value) if isinstance(value, np.ndarray) else (2,)
            if isinstance(value, MAY_BE.get(item, ())) and str(value) != str({"a": 1}) and shape == (2,):
                continue
            with pytest.raises(SceneError) as caught:
                owner(**{item: value})
            one_sentence(caught.value, f"{owner.__name__}.")


def test_sizes_that_overflow_are_refused():
    rng = np.random.default_rng(7)
    names = ("length", "width", "thickness", "young", "density")
    refused = 0
    for _ in range(300):
        sizes = {name: 10.0 ** rng.uniform(-320, 308) for name in names}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                ribbon = Ribbon(**{name: size for name, size in sizes.items() if size > 0.0})
            except SceneError as error:
                one_sentence(error, "Ribbon")
                refused += 1
            else:
                assert all(math.isfinite(getattr(ribbon, n)) for n in ("stretch_ratio", "twist_ratio"))
    assert refused > 200


@pytest.mark.parametrize(
    ("model", "options", "word"),
    [
        (der, {"step": 1e-30}, "1e+29 steps"),
        (elastica, {"step": 1e-30}, "1e+29 steps"),
        (quasilinear, {"step": 1e-12}, "1e+11 steps"),
        (der, {"nodes": 10**9}, "bytes"),
        (elastica, {"elements": 10**9}, "bytes"),
        (der, {"every": 10**20}, "at most 1000000000"),
        (der, {"step": 2e-10, "nodes": 2001, "every": 1}, "bytes"),
    ],
)
def test_what_cannot_be_afforded_is_refused_with_the_number(model, options, word):
    with pytest.raises(OptionError) as caught:
        model.simulate(PLANAR, **options)
    one_sentence(caught.value, next(iter(options)), word)


@pytest.mark.parametrize("model", [der, elastica, quasilinear])
@pytest.mark.parametrize(
    ("field", "scene"),
    [
        ("rate", {"rate": 1e-300}),
        ("rate", {"rate": 5e-324}),
        ("hold", {"hold": 1e300}),
        ("stop", {"stop": 1e300}),
    ],
)
def test_scenes_that_would_not_end_are_refused(model, field, scene):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        endless = Scene(**{"compression": 0.4, "shear": 0.0, "start": "U+", "stop": 0.5, **scene})
    with pytest.raises(SceneError) as caught:
        model.simulate(endless)
    one_sentence(caught.value, f"Scene.{field}")


def test_a_step_of_any_length_is_shortened_to_the_ramp():
    whole = elastica.simulate(PLANAR, elements=6, method="implicit-euler", step=0.1)
    for step in (1e7, 1e9, 1e10, 1e300):
        long = elastica.simulate(PLANAR, elements=6, method="implicit-euler", step=step)
        assert np.array_equal(long.height, whole.height)


def test_calls_that_no_verb_takes():
    with pytest.raises(
        KeywordError, match=r"elements = 5: der\.simulate has no such keyword; it takes scene"
    ):
        der.simulate(PLANAR, elements=5)
    with pytest.raises(TypeError, match="takes scene"):
        der.simulate()
    with pytest.raises(OptionError, match="a Scene is needed"):
        kirchhoff.folds(Ribbon())
    with pytest.raises(AttributeError, match="perhaps 'simulate' is meant"):
        der.simulates  # noqa: B018
    with pytest.raises(AttributeError, match=r"it has .*equilibria, escape, fold_curve, folds"):
        kirchhoff.swing  # noqa: B018
    with pytest.raises(KeywordError, match=r"too many positional.* takes compression, and by keyword ribbon"):
        kirchhoff.pitchforks(0.25, Ribbon())
    with pytest.raises(OptionError, match="Steps"):
        der.folds(PLANAR, steps=0.1)
    assert ribbonfem.OptionError is OptionError


def test_of_several_options_that_cannot_be_the_first_of_the_signature_is_told():
    for options in ({"step": -1, "tolerance": -1}, {"tolerance": -1, "step": -1}):
        with pytest.raises(OptionError, match=r"^step = -1"):
            kirchhoff.simulate(PLANAR, **options)
        with pytest.raises(OptionError, match=r"^scene = 3"):
            kirchhoff.simulate(**options, scene=3)


@pytest.mark.parametrize("value", [*NO_NUMBERS, *NO_FINITE, 0, -1, None, True])
def test_choose_refuses(value):
    for name, call in (
        ("tolerance", lambda: choose(PLANAR, value)),
        ("quantity", lambda: choose(PLANAR, 1e-3, value)),
        ("scene", lambda: choose(value, 1e-3)),
    ):
        with pytest.raises(OptionError) as caught:
            call()
        one_sentence(caught.value, name)


@pytest.mark.parametrize("value", [*NO_NUMBERS, *NO_FINITE, 0, -1, None, True])
def test_convergence_refuses(value):
    scene, over = replace(PLANAR, stop=None), {"elements": (4, 6, 8)}
    for name, call in (
        ("model", lambda: convergence(value, scene, "fold", over)),
        ("scene", lambda: convergence(elastica, value, "fold", over)),
        ("over", lambda: convergence(elastica, scene, "fold", value)),
        ("elements", lambda: convergence(elastica, scene, "fold", {"elements": value})),
        ("elements", lambda: convergence(elastica, scene, "fold", {"elements": (4, value, 8)})),
        ("bogus", lambda: convergence(elastica, scene, "fold", over, bogus=value)),
    ):
        if name == "elements" and isinstance(value, range):
            continue
        with pytest.raises(OptionError) as caught:
            call()
        one_sentence(caught.value, name)
    if not callable(value):
        with pytest.raises(OptionError, match="quantity"):
            convergence(elastica, scene, value, over)


@pytest.mark.parametrize("value", [*NO_NUMBERS, *NO_FINITE, None, True])
def test_delays_refuse(value):
    form = delay.NormalForm(1.1, 1e5)
    for name, call in (
        ("damping", lambda: delay.universal(value)),
        ("rate", lambda: delay.predict(form, value, 1.0)),
        ("damping", lambda: delay.predict(form, 0.1, value)),
        ("fold", lambda: delay.predict(value, 0.1, 1.0)),
    ):
        with pytest.raises(OptionError) as caught:
            call()
        one_sentence(caught.value, name)


def test_delays_of_any_damping():
    """f(Lambda) goes over into that of Airy's equation without a jump, and on to any Lambda."""
    assert delay.universal(1.0001e6) / delay.universal(0.9999e6) == pytest.approx(
        (1.0001 / 0.9999) ** (2 / 3), rel=3e-9
    )
    assert delay.universal(1e300) == pytest.approx(2.338107410459767e200)


@pytest.mark.parametrize(
    "slip",
    [
        lambda: Ribbon(length=1000, width=200, thickness=10),
        lambda: Ribbon(length=100, width=20, thickness=1),
        lambda: Ribbon(thickness=10),
        lambda: Ribbon(width=200),
        lambda: Ribbon(young=200),
        lambda: Ribbon(young=0.1),
        lambda: Scene(stop=60),
        lambda: Scene(rate=-0.1, stop=-90),
    ],
)
def test_plausible_slips_are_told(slip):
    with pytest.warns(SceneWarning, match="not in (mm|GPa|degrees)") as told:
        slip()
    # where the slip was made
    assert {(warned.filename, warned.lineno) for warned in told} == {(__file__, slip.__code__.co_firstlineno)}


def test_what_is_usual_is_not_told():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Ribbon(length=10.0, width=2.0, thickness=0.1, young=1e6)
        Ribbon(thickness=0.05, width=0.02)
        Ribbon(length=3e-4, width=6e-5, thickness=3e-6, young=2e11)
        Scene(stop=6.0 * math.pi)


def test_a_ribbon_closed_upon_itself_ends_in_an_error():
    """Where the guess of the start is no number the descent to it used to go on for ever."""
    for compression, shear in ((1.0 - 1e-14, 0.9935), (1.0 - 1.2e-13, 0.999997)):
        scene = Scene(compression=compression, shear=shear, start="U+")
        with pytest.raises((SolverError, SceneError)) as caught:
            der.folds(scene, nodes=15)
        one_sentence(caught.value)


def numbers_of_questions():
    """Every option of every command that is a number or several, of which -1 cannot be."""
    for name in ORDER:
        main = named(name).main
        if any(p.default is p.empty for p in inspect.signature(main).parameters.values()):
            # needs a scene file first
            continue
        for keyword, annotation in get_type_hints(main).items():
            if annotation in (int, float):
                yield name, keyword, -1
            elif annotation in (tuple[int, ...], tuple[float, ...]):
                yield name, keyword, (-1,)


@pytest.mark.parametrize(("name", "keyword", "value"), list(numbers_of_questions()))
def test_a_question_refuses_a_number_before_anything_runs(name, keyword, value):
    with pytest.raises(ValueError, match=r"= \(?-1"):
        named(name).main(**{keyword: value}, sweep=Sweep(processes=1))


def test_a_call_tells_its_options_as_its_signature_has_them():
    @checked
    def inner(scene, *, tolerance=None, initial=None):
        return options_given()

    @checked
    def outer(scene, *, elements=8, step=None, tolerance=None, steps=None):
        with pytest.raises(OptionError):
            inner(scene, tolerance=-1.0)
        return inner(scene), options_given(tolerance=1e-3)

    scene = Scene(stop=0.5)
    first, second = outer(scene, step=2, elements=4)
    assert first == {"tolerance": None}
    assert list(second.items()) == [("elements", 4), ("step", 2.0), ("tolerance", 1e-3)]


@pytest.mark.parametrize("model", [quasilinear, elastica, kirchhoff, der])
@pytest.mark.parametrize("function", ["equilibria", "simulate", "escape"])
def test_results_carry_every_option_that_there_is(model, function):
    planar = Scene(compression=0.40, shear=0.0, start="U+", rate=10.0, stop=0.1)
    mesh = {"nodes": 21} if model is der else {"elements": 4}
    call = getattr(model, function)
    result = call(planar, **mesh, **({"until": "snap"} if function == "escape" else {}))
    names = [name for name in inspect.signature(call).parameters if name not in ("scene", "initial", "steps")]
    assert list(result.options) == names
    assert result.options.items() >= mesh.items()
