"""Algebra of compiled code against the rules of quaternions, and against matrices."""

import numpy as np
import pytest

from ribbonfem.jit.algebra import along_i, between, by_i, by_vector, carried, conjugate, cross, of_vector

RANDOM = np.random.default_rng(5)
Q, P = RANDOM.normal(size=(2, 4))
U = tuple(Q / np.linalg.norm(Q))
V = tuple(RANDOM.normal(size=3))


def product(a, b):
    """Of two quaternions."""
    a, b = np.asarray(a), np.asarray(b)
    return np.r_[a[0] * b[0] - a[1:] @ b[1:], a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])]


def rotation(q):
    """The matrix of a unit quaternion, by Rodrigues' formula."""
    w, axis = q[0], np.array(q[1:])
    skew = np.cross(np.eye(3), axis)
    return np.eye(3) + 2 * w * skew + 2 * skew @ skew


def test_products():
    q, p = tuple(Q), tuple(P)
    assert by_vector(q, V) == pytest.approx(product(q, (0, *V)), abs=1e-14)
    assert of_vector(V, q) == pytest.approx(product((0, *V), q), abs=1e-14)
    assert by_i(q) == pytest.approx(product(q, (0, 1, 0, 0)), abs=1e-14)
    assert between(q, p) == pytest.approx(product(conjugate(q), p)[1:], abs=1e-14)
    assert cross(V, q[1:]) == pytest.approx(np.cross(V, q[1:]), abs=1e-14)


def test_turns():
    assert carried(U, V) == pytest.approx(rotation(U) @ V, abs=1e-14)
    assert carried(conjugate(U), carried(U, V)) == pytest.approx(V, abs=1e-14)
    assert along_i(U, U) == pytest.approx(rotation(U)[:, 0], abs=1e-14)


def test_the_form_of_the_first_axis_is_symmetric_and_gives_its_derivative():
    q, p, h = tuple(Q), tuple(P), 1e-20
    assert along_i(q, p) == pytest.approx(along_i(p, q), abs=1e-14)
    step = tuple(Q + 1j * h * P)
    changed = np.array(getattr(along_i, "py_func", along_i)(step, step)).imag / h
    assert 2 * np.array(along_i(q, p)) == pytest.approx(changed, rel=1e-13)
