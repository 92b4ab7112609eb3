import numpy as np
import pytest

from ribbonfem import History, Scene


def history(time, height, **fields):
    time = np.asarray(time)
    return History(
        time=time,
        control=0.1 * time,
        height=np.asarray(height),
        slope=np.cos(time),
        energies={},
        configurations={},
        stats={},
        scene=Scene(),
        **fields,
    )


def test_crossing_is_of_fourth_order():
    worst = []
    for step in (0.2, 0.1):
        errors = []
        for offset in np.linspace(0.0, step, 8, endpoint=False):
            time = np.arange(0.0, 4.0, step) + offset
            result = history(time, np.exp(-time) - 0.2).crossing()
            errors.append(abs(result[0] - np.log(5.0)))
            assert np.isclose(result[1], 0.1 * result[0])
        worst.append(max(errors))
    assert worst[1] < 3e-6
    assert 12.0 < worst[0] / worst[1] < 20.0, f"expected 2^4, observed {worst[0] / worst[1]}"


def test_crossing_is_of_sixth_order_with_velocities():
    worst = []
    for step in (0.4, 0.2):
        errors = []
        for offset in np.linspace(0.0, step, 8, endpoint=False):
            time = np.arange(0.0, 4.0, step) + offset
            result = history(time, np.exp(-time) - 0.2, velocity=-np.exp(-time)).crossing()
            errors.append(abs(result[0] - np.log(5.0)))
        worst.append(max(errors))
    assert worst[1] < 3e-8
    assert 45.0 < worst[0] / worst[1] < 80.0, f"expected 2^6, observed {worst[0] / worst[1]}"


def test_crossing_behind_a_kink_takes_nothing_of_what_was_before():
    """The clamp stops at 1 and the height falls faster from then on; the row there has the slower one."""
    time = np.arange(0.0, 2.0, 0.1)
    late = np.maximum(time - 1.0, 0.0)
    height, velocity = 0.2 - 0.1 * time - np.expm1(late), -0.1 - np.where(time > 1.05, np.exp(late), 0.0)
    made = history(time, height, velocity=velocity)
    stopped = History(**{**vars(made), "control": 0.1 * np.minimum(time, 1.0)})
    root = stopped.crossing()[0]
    assert 1.05 < root < 1.1
    assert abs(0.2 - 0.1 * root - np.expm1(root - 1.0)) < 2e-7


def test_velocities_that_are_not_known_leave_the_cubic():
    time = np.arange(0.0, 4.0, 0.2)
    whole = history(time, np.exp(-time) - 0.2)
    assert np.isnan(whole.velocity).all()
    part = history(time, np.exp(-time) - 0.2, velocity=np.where(time < 1.5, -np.exp(-time), np.nan))
    assert part.crossing() == whole.crossing()


def test_crossing_of_slope_level_and_absence():
    time = np.linspace(0.0, 3.0, 61)
    record = history(time, 1.0 + time)
    assert np.isclose(record.crossing("slope")[0], np.pi / 2, atol=1e-6)
    assert np.isclose(record.crossing("height", 2.5)[0], 1.5)
    assert record.crossing() is None
    with pytest.raises(ValueError, match="quantity = 'energy'"):
        record.crossing("energy")


def test_crossing_on_a_row_is_that_row():
    assert history([0.0, 1.0, 2.0, 3.0], [2.0, 1.0, 0.0, -1.0]).crossing()[0] == 2.0
