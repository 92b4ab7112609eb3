"""Curves of equilibria: folds, branch points, closing, the edge of the span, step control."""

from dataclasses import dataclass, fields, replace

import numpy as np
import pytest

from ribbonfem import Scene, SolverError, quasilinear
from ribbonfem.continuation import (
    Linearisation,
    Point,
    Segment,
    Steps,
    at_parameter,
    equilibrium,
    first_point,
    switch,
    trace,
)
from ribbonfem.continuation.between import root
from ribbonfem.continuation.corrector import NotConverged, correct
from ribbonfem.ends import Ends
from ribbonfem.kirchhoff.problem import Statics
from ribbonfem.kirchhoff.states import named


@dataclass
class Toy:
    """Equations in two unknowns, F, J and F_p given as functions of (u, p)."""

    equations: object
    weight: np.ndarray = None
    parameter_weight: float = 1.0

    def __post_init__(self):
        self.weight = np.ones(2)

    def linearise(self, state, parameter):
        residual, matrix, slope = (np.array(k, dtype=float) for k in self.equations(state, parameter))
        return Linearisation(
            residual, slope, lambda x: np.linalg.solve(matrix, x), int(np.sum(np.linalg.eigvalsh(matrix) < 0))
        )

    def advance(self, state, increment, parameter):
        return state + increment

    def observe(self, state, parameter):
        return float(state[0]), float(state[1]), 0.0

    def energy(self, state):
        return 0.0

    def positions(self, state, parameter):
        return np.array([[state[0], 0.0, state[1]]])


def circle(u, p):
    return (u[0] ** 2 + p**2 - 1, u[1]), ((2 * u[0], 0), (0, 1)), (2 * p, 0)


def fork(u, p):
    """u0 = 0 and p = u0^2 + u0^4; u1 = p goes along."""
    return (
        (u[0] ** 3 + u[0] ** 5 - p * u[0], u[1] - p),
        ((3 * u[0] ** 2 + 5 * u[0] ** 4 - p, 0), (0, 1)),
        (-u[0], -1),
    )


def slanted(u, p):
    """Lines u0 = 0 and u0 = p: a transcritical point at p = 0."""
    return (u[0] ** 2 - p * u[0], u[1]), ((2 * u[0] - p, 0), (0, 1)), (-u[0], 0)


def events_of(problem, state, parameter, span, sign=1.0, steps=None):
    segments = list(trace(problem, first_point(problem, state, parameter, sign), span, steps))
    return segments, [event for segment in segments for event in segment.events]


@pytest.mark.parametrize("start", [0.0, 0.6, -0.999])
def test_a_closed_curve_ends_where_it_began(start):
    problem = Toy(circle)
    state = np.array([np.sqrt(1 - start**2), 0.0])
    segments, events = events_of(problem, state, start, (-2, 2))
    assert segments[-1].last == "closed"
    assert segments[-1].end.parameter == start
    assert segments[-1].end.state == pytest.approx(state, abs=1e-12)
    assert [event.kind for event in events] == ["fold", "fold"]
    assert [event.point.parameter for event in events] == pytest.approx([1.0, -1.0], abs=1e-13)
    length = sum(segment.end.step for segment in segments[:-1])
    assert 2 * np.pi * 0.9 < length < 2 * np.pi * 1.01


def test_the_last_point_lies_on_the_edge_of_the_span_also_past_a_fold():
    segments, events = events_of(Toy(circle), np.array([1.0, 0.0]), 0.0, (-0.3, 0.9999))
    assert segments[-1].last == "span"
    assert segments[-1].end.parameter == 0.9999
    assert not events
    segments, events = events_of(Toy(circle), np.array([1.0, 0.0]), 0.0, (-0.3, 1.1))
    assert segments[-1].end.parameter == -0.3
    assert segments[-1].end.state[0] == pytest.approx(-np.sqrt(0.91), abs=1e-12)
    assert len(events) == 1


def test_branch_point_is_found_and_its_other_curve_switched_to():
    problem = Toy(fork)
    segments, events = events_of(problem, np.array([0.0, -0.5]), -0.5, (-1, 0.7))
    assert [event.kind for event in events] == ["branch point"]
    assert abs(events[0].point.parameter) < 1e-9
    assert np.abs(events[0].null) == pytest.approx([1, 0], abs=1e-6)
    assert (segments[0].start.index, segments[-1].end.index) == (0, 1)
    for side in (1.0, -1.0):
        point = switch(problem, events[0], 0.1 * side)
        u = point.state[0]
        assert u * side * np.sign(events[0].null[0]) > 0.05
        assert point.parameter == pytest.approx(u**2 + u**4, abs=1e-9)
        assert point.index == 0


def test_the_tip_of_a_fork_is_a_branch_point_and_no_fold():
    problem = Toy(fork)
    u = 0.6
    state = np.array([u, u**2 + u**4])
    segments, events = events_of(problem, state, u**2 + u**4, (-1, 0.7), sign=-1.0)
    assert [event.kind for event in events] == ["branch point"]
    assert abs(events[0].point.parameter) < 1e-10
    assert segments[-1].last == "span"
    # it goes through to the other side of the fork, stable all along
    assert segments[-1].end.state[0] < -0.5
    assert {segment.end.index for segment in segments} == {0}


def test_crossing_of_two_curves_is_passed_straight_on():
    segments, events = events_of(Toy(slanted), np.array([0.0, 0.0]), -0.5, (-1, 0.5))
    assert [event.kind for event in events] == ["branch point"]
    assert segments[-1].end.state[0] == pytest.approx(0.0, abs=1e-12)


def test_parameter_inside_a_segment():
    problem = Toy(circle)
    first = first_point(problem, np.array([1.0, 0.0]), 0.0, 1.0)
    segment = next(iter(trace(problem, first, (-2, 2), Steps(first=0.3, largest=0.3))))
    point = at_parameter(problem, segment, 0.123)
    assert point.parameter == 0.123
    assert point.state[0] == pytest.approx(np.sqrt(1 - 0.123**2), abs=1e-14)
    assert abs(point.direction[0] / point.rate) == pytest.approx(0.123 / np.sqrt(1 - 0.123**2), rel=1e-9)
    with pytest.raises(SolverError, match="was not found between"):
        at_parameter(problem, segment, 0.9)


def test_failures_say_what_to_change():
    with pytest.raises(SolverError, match="start from a closer guess"):
        equilibrium(Toy(circle), np.array([0.5, 0.0]), 1.5)
    with pytest.raises(SolverError, match="allow more, or longer steps"):
        events_of(Toy(circle), np.array([1.0, 0.0]), 0.0, (-2, 2), steps=Steps(most=5))
    with pytest.raises(ValueError, match=r"Steps\.turn = -1"):
        Steps(turn=-1)


def scaled(name, factor):
    value = getattr(Steps(), name)
    return Steps(**{name: max(1, round(value * factor)) if isinstance(value, int) else value * factor})


def folds_along(problem, state, steps, span=(-1.5, 1.5)):
    _, events = events_of(problem, state, 0.0, span, steps=steps)
    return [(event.kind, event.point.parameter) for event in events]


@pytest.mark.parametrize("name", [item.name for item in fields(Steps)])
@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_no_step_control_changes_a_fold_of_the_ribbon(name, factor):
    # the isola at alpha -1.28 .. -0.66 lies within reach of a long step
    problem, start = named(Scene(compression=0.40, shear=0.40), elements=12, extensible=False)
    expected = folds_along(problem, start, Steps())
    result = folds_along(problem, start, scaled(name, factor))
    assert [kind for kind, _ in result] == [kind for kind, _ in expected] == ["fold"] * 7
    assert [p for _, p in result] == pytest.approx([p for _, p in expected], abs=1e-9)


@pytest.mark.parametrize("turn", [0.7, 1.4])
def test_a_step_onto_another_curve_is_noticed_by_the_index_alone(turn):
    # with the check of the correction out of force, steps past the third fold land on the isola
    problem, start = named(Scene(compression=0.40, shear=0.40), elements=12, extensible=False)
    expected = folds_along(problem, start, Steps())
    result = folds_along(problem, start, Steps(turn=turn, correction=16.0, largest=1.0))
    assert [kind for kind, _ in result] == ["fold"] * 7
    assert [p for _, p in result] == pytest.approx([p for _, p in expected], abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", [item.name for item in fields(Steps)])
@pytest.mark.parametrize(
    ("compression", "shear", "start"),
    [
        (0.35, 0.40, "U+S+"),
        (0.20, 0.25, "U+S+"),
        (0.40, 0.37, "U+S-"),
        (0.30, 0.40, "U+S+"),
        (0.4, 0.2, "U+"),
    ],
)
def test_no_step_control_changes_a_fold_anywhere(compression, shear, start, name):
    scene = Scene(compression=compression, shear=shear, start=start)
    problem, state = named(scene, elements=16, extensible=False)
    expected = folds_along(problem, state, Steps())
    for factor in (0.25, 0.5, 2.0, 4.0):
        result = folds_along(problem, state, scaled(name, factor))
        assert [kind for kind, _ in result] == [kind for kind, _ in expected]
        assert [p for _, p in result] == pytest.approx([p for _, p in expected], abs=1e-9)


@pytest.mark.parametrize("name", ["first", "largest", "turn", "correction", "newton", "tolerance"])
@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_no_step_control_changes_a_fold_of_the_beam(name, factor):
    scene = Scene(shear=0.0, start="U+")
    expected = quasilinear.equilibria(scene, elements=24).folds
    result = quasilinear.equilibria(scene, elements=24, steps=scaled(name, factor)).folds
    assert [f.angle for f in result] == pytest.approx([f.angle for f in expected], abs=1e-9)


def test_the_isola_is_a_closed_curve_of_its_own():
    """Reached through smaller compression, where it is a part of the main curve."""
    scene = Scene(compression=0.35, shear=0.40)
    problem, start = named(scene, elements=12, extensible=False)
    angle, passed = -1.1, 0
    for segment in trace(problem, first_point(problem, start, 0.0, 1.0), (-1.5, 1.5)):
        passed += len(segment.events)
        ends = segment.start.parameter - angle, segment.end.parameter - angle
        if passed == 3 and not segment.events and ends[0] * ends[1] < 0.0:
            point = at_parameter(problem, segment, angle)
            break
    varying = Ends.varying("dL", 0.35, 0.40)
    held = replace(varying, fixed=np.array([angle, *(0.0,) * 7]))
    wider = Statics(scene.ribbon, held, elements=12)
    *_, last = trace(wider, first_point(wider, point.state, 0.35, 1.0), (0.3, 0.40))
    assert isinstance(last, Segment)
    assert last.end.parameter == 0.40
    there = Statics(scene.ribbon, Ends.varying("left", 0.40, 0.40), elements=12)
    segments, events = events_of(there, last.end.state, angle, (-3, 3))
    assert segments[-1].last == "closed"
    assert [event.kind for event in events] == ["fold", "fold"]
    result = sorted(event.point.parameter for event in events)
    assert result == pytest.approx([-1.276726, -0.659827], abs=2e-6)
    main = [p for _, p in folds_along(*named(Scene(shear=0.40), elements=12, extensible=False), Steps())]
    assert min(abs(p - q) for p in main for q in result) > 0.05


def test_states_that_fork_from_u_close_on_themselves_in_the_shear():
    """U+S+, S+, U-S-, U-, U-S+, S-, U+S-, U+: four tips and no fold."""
    problem = Statics(Scene().ribbon, Ends.varying("dW", 0.40, 0.0), elements=12)
    start = first_point(problem, problem.buckled(0.40), 0.0, 1.0)
    events = [event for segment in trace(problem, start, (-0.1, 0.40)) for event in segment.events]
    assert [event.kind for event in events] == ["branch point"]
    point = switch(problem, events[0], 0.03)
    assert isinstance(point, Point)
    segments = list(trace(problem, point, (0.2, 0.6), Steps(largest=0.08)))
    assert segments[-1].last == "closed"
    tips = [event for segment in segments for event in segment.events]
    assert [event.kind for event in tips] == ["branch point"] * 4
    shears = sorted(event.point.parameter for event in tips)
    assert shears == pytest.approx([0.3331031] * 2 + [0.4906103] * 2, abs=1e-6)
    assert {segment.end.index for segment in segments} == {0}


@pytest.mark.parametrize(
    ("function", "exact"),
    [
        (lambda x: x**3 - 2.0, 2.0 ** (1 / 3)),
        (lambda x: np.cos(x) - x, 0.7390851332151607),
        (lambda x: np.tanh(30.0 * (x - 0.3)), 0.3),
        # at an end, but for rounding
        (lambda x: 2.0 - x - 1e-13, 2.0),
        (lambda x: -1e-15 - x, 0.0),
    ],
)
def test_roots_in_few_values(function, exact):
    asked = []

    def value(x):
        asked.append(x)
        return float(function(x))

    low, high = (-1.0, 1.0) if exact == 0.0 else (0.0, 2.0)
    assert root(value, low, high, 1e-9) == pytest.approx(exact, abs=1e-9)
    assert len(asked) < 16
    with pytest.raises(ValueError, match="no root"):
        root(value, 5.0, 6.0, 1e-9)


def test_where_no_value_is_found_beside_a_root_the_least_counts():
    def value(x):
        if abs(x - 0.5) < 1e-9:
            raise NotConverged
        return x - 0.5 + 0.1 * (x - 0.5) ** 2

    assert root(value, 0.0, 1.0, 1e-14) == pytest.approx(0.5, abs=1e-7)


def test_a_jump_is_no_root():
    """Two curves that pass close by: the test function of either does not vanish."""
    for low, high in ((-1.0, 3.0), (-0.4, 0.1)):
        with pytest.raises(NotConverged):
            root(lambda x, low=low, high=high: low + x if x < 0.3 else high + x, 0.0, 1.0, 1e-10)


class Wandering:
    """Equations whose Newton increments have given sizes, wherever they are asked for."""

    weight, parameter_weight = np.ones(1), 1.0

    def __init__(self, *sizes):
        self.sizes = iter(sizes)

    def linearise(self, state, parameter):
        return Linearisation(np.array([next(self.sizes)]), np.zeros(1), lambda x: x, 0)

    def advance(self, state, increment, parameter):
        return state + increment


def test_a_strict_step_is_refused_where_corrections_grow_again():
    """The second may be larger than the first; a later one that is leads onto another curve."""
    start = Point(np.zeros(1), 0.0, np.zeros(1), 1.0, 0, Wandering(0.0).linearise(0.0, 0.0))
    wanders, settles = (1e-3, 2e-3, 1e-4, 2e-4, 1e-9), (1e-3, 2e-3, 1e-4, 1e-9)
    assert correct(Wandering(*wanders), start, 0.1, Steps()).iterations == 5
    assert correct(Wandering(*settles), start, 0.1, Steps(), strict=True).iterations == 4
    with pytest.raises(NotConverged):
        correct(Wandering(*wanders), start, 0.1, Steps(), strict=True)


def test_a_wide_bracket_of_what_is_asked_for_roughly_is_left():
    """High above low by ten times `within`, and the root at the end: it went round and round."""
    high = 0.02758198007926773
    result = root(lambda x: 0.39 if x < 0.9999 * high else -0.01, 0.0, high, 0.1 * high, 0.99 * high)
    assert abs(result - high) <= 0.15 * high
