import numpy as np
import pytest

from ribbonfem import History, Scene


def history(time, height):
    time = np.asarray(time)
    return History(
        time=time,
        angle=0.1 * time,
        height=np.asarray(height),
        slope=np.cos(time),
        energies={},
        configurations={},
        stats={},
        scene=Scene(),
    )


def test_crossing_is_of_fourth_order():
    worst = []
    for step in (0.2, 0.1):
        errors = []
        for offset in np.linspace(0.0, step, 8, endpoint=False):
            time = np.arange(0.0, 4.0, step) + offset
            found = history(time, np.exp(-time) - 0.2).crossing()
            errors.append(abs(found[0] - np.log(5.0)))
            assert np.isclose(found[1], 0.1 * found[0])
        worst.append(max(errors))
    assert worst[1] < 3e-6
    assert 12.0 < worst[0] / worst[1] < 20.0, f"expected 2^4, observed {worst[0] / worst[1]}"


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
