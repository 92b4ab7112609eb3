"""Four numbers at a time: the compiler's vectors against arrays."""

import contextlib
import io
import operator
import os
import subprocess
import sys

import numpy as np
import pytest

from ribbonfem.jit import simd, simd_arrays, simd_vectors
from ribbonfem.jit.decorator import compiled

RNG = np.random.default_rng(3)
A, B = RNG.normal(size=(2, 3, 4)), RNG.normal(size=(2, 3, 4))


def stored(operation):
    """What an operation on two entries leaves, by the compiler."""

    @compiled()
    def kernel(a, b, out):
        simd_vectors.store(
            out, (0,), operation(simd_vectors.load(a, (1, 2)), simd_vectors.load(b, (0, 1)), 3.0)
        )

    out = np.zeros((1, 4))
    kernel(A, B, out)
    return out[0]


@compiled()
def _in_turn(a, b, x):
    a += b
    a -= x * b
    a *= b / x
    a /= b
    return -a


@compiled()
def _ratios(a, b, x):
    return a / b + x / b - a / x


def in_turn(a, b, x):
    return -((a + b - x * b) * (b / x) / b)


@pytest.mark.parametrize(
    ("ours", "theirs"), [(_in_turn, in_turn), (_ratios, lambda a, b, x: a / b + x / b - a / x)]
)
def test_arithmetic(ours, theirs):
    expected = theirs(A[1, 2], B[0, 1], 3.0)
    assert np.allclose(stored(ours), expected, rtol=1e-14)
    plainly = ours.py_func(simd_arrays.load(A, (1, 2)), simd_arrays.load(B, (0, 1)), 3.0)
    assert np.allclose(plainly.places, expected, rtol=1e-14)


@pytest.mark.parametrize("operation", [operator.add, operator.sub, operator.mul, operator.truediv])
def test_each_place_is_its_own(operation):
    @compiled()
    def kernel(a, b, x):
        return operation(a, b)

    assert np.allclose(stored(kernel), operation(A[1, 2], B[0, 1]), rtol=1e-15)


@compiled()
def _everything(rows, out, numbers):
    a, b, c, d = simd.transposed(
        simd.load(rows, (0,)), simd.load(rows, (1,)), simd.load(rows, (2,)), simd.load(rows, (3,))
    )
    simd.store(out, (0,), a)
    simd.store(out, (1,), b)
    simd.store(out, (2,), simd.larger(c, d))
    simd.store(out, (3,), simd.root(d * d))
    simd.store(out, (4,), simd.spread(2.5))
    for i in range(4):
        numbers[i] = simd.lane(a, i)
    return simd.all_below(a, 1.0), simd.all_below(a, 1e3)


def _expected(rows):
    a, b, c, d = rows.T
    return np.stack((a, b, np.maximum(c, d), abs(d), np.full(4, 2.5)))


def test_rows_and_columns():
    rows = np.concatenate((A[0], B[0][:1]))
    rows[2, 0] = 10.0
    out, numbers = np.zeros((5, 4)), np.zeros(4)
    assert _everything(rows, out, numbers) == (False, True)
    assert np.array_equal(out, _expected(rows))
    assert np.array_equal(numbers, rows[:, 0])
    rows[1, 0] = np.nan
    # NaN is below nothing, wherever it stands
    assert _everything(rows, out, numbers) == (False, False)


@pytest.mark.parametrize(("first", "second"), [(1.0, np.nan), (np.nan, 1.0)])
def test_of_nan_the_first_stays(first, second):
    @compiled()
    def kernel(a, b, out):
        simd_vectors.store(
            out, (0,), simd_vectors.larger(simd_vectors.load(a, (0,)), simd_vectors.load(b, (0,)))
        )

    a, b, out = np.full((1, 4), first), np.full((1, 4), second), np.zeros((1, 4))
    kernel(a, b, out)
    plainly = simd_arrays.larger(simd_arrays.load(a, (0,)), simd_arrays.load(b, (0,)))
    assert np.array_equal(out, a, equal_nan=True)
    assert np.array_equal(plainly.places, a[0], equal_nan=True)


SHORT = """
from ribbonfem import Scene, kirchhoff
scene = Scene(compression=0.40, shear=0.10, start="U+", rate=0.1, stop=0.001)
history = kirchhoff.simulate(scene, elements=6, extensible=True, method="implicit-euler", step=5e-3)
print(history.height[-1], history.energies["elastic"][-1], history.load[-1])
"""


def test_a_motion_is_the_same_with_the_compiler_switched_off():
    """The kernels as they are read, by Python, against the machine's: a full group, and one that is not."""
    names = {}
    with contextlib.redirect_stdout(io.StringIO()) as ours:
        exec(SHORT, names)
    assert len(names["history"]) == 3
    plainly = subprocess.run(
        [sys.executable, "-c", SHORT],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
    )
    assert plainly.returncode == 0, plainly.stderr
    assert np.allclose(
        *(np.array(text.split(), float) for text in (plainly.stdout, ours.getvalue())), rtol=1e-9
    )


@compiled()
def _shifted(a, out):
    simd.store_from(out, (0, 1), 2.0 * simd.load_from(a, (1, 3)))


@pytest.mark.parametrize("kernel", [_shifted, _shifted.py_func])
def test_four_in_a_row_from_any_place_on(kernel, monkeypatch):
    if kernel is not _shifted:
        for name in ("load_from", "store_from"):
            monkeypatch.setattr(simd, name, getattr(simd_arrays, name))
    a, out = np.arange(20.0).reshape(2, 10), np.zeros((2, 8))
    kernel(a, out)
    assert out.tolist() == [[0, 26, 28, 30, 32, 0, 0, 0], [0] * 8]
