"""L D L^T of the rod's banded Hessian (half-bandwidth 10): factors, solutions, products."""

from __future__ import annotations

import numpy as np

from ribbonfem.jit.decorator import compiled

from .frames import OPTIONS

WIDTH = 10  # half-bandwidth
FIRST = 7  # first free unknown: theta^1; the last is theta^(N-3), number 4 N - 9


@compiled(**OPTIONS)
def factor(a, first, last):
    """Overwrite rows first .. last - 1 of a band (rows, 11) with its L D L^T; count negative pivots.

    Ten rows beyond `last` are overwritten: they must be scratch or not needed.  The trip counts
    are constants, which lets the compiler unroll both loops.
    """
    for i in range(last, last + WIDTH):
        for d in range(WIDTH + 1):
            a[i, d] = 0.0
    for i in range(max(first, last - WIDTH), last):
        for d in range(last - i, WIDTH + 1):
            a[i, d] = 0.0
    negative = 0
    for i in range(first, last):
        pivot = a[i, 0]
        if pivot < 0.0:
            negative += 1
        inverse = 1.0 / pivot
        for d in range(1, WIDTH + 1):
            ratio = a[i, d] * inverse
            for e in range(d, WIDTH + 1):
                a[i + d, e - d] -= ratio * a[i, e]
        for d in range(1, WIDTH + 1):
            a[i, d] *= inverse
        a[i, 0] = inverse
    return negative


@compiled(**OPTIONS)
def solve(a, first, last, x):
    """Overwrite x[first:last] with the solution; x has ten entries beyond `last` to spare."""
    for i in range(last, last + WIDTH):
        x[i] = 0.0
    for i in range(first, last):
        value = x[i]
        for d in range(1, WIDTH + 1):
            x[i + d] -= a[i, d] * value
    for i in range(last, last + WIDTH):
        x[i] = 0.0
    for i in range(last - 1, first - 1, -1):
        # four sums side by side: one would wait ten times for the one before
        one = a[i, 1] * x[i + 1] + a[i, 5] * x[i + 5] + a[i, 9] * x[i + 9]
        two = a[i, 2] * x[i + 2] + a[i, 6] * x[i + 6] + a[i, 10] * x[i + 10]
        three = a[i, 3] * x[i + 3] + a[i, 7] * x[i + 7]
        four = a[i, 4] * x[i + 4] + a[i, 8] * x[i + 8]
        x[i] = x[i] * a[i, 0] - ((two + three) + four) - one


@compiled(allocates=True, **OPTIONS)
def multiply(a, first, last, x):
    """Product of the unfactored band's rows and columns first .. last - 1 with x, as a new array."""
    y = np.zeros(x.shape[0])
    for i in range(first, last):
        total = a[i, 0] * x[i]
        for d in range(1, min(WIDTH, last - 1 - i) + 1):
            y[i + d] += a[i, d] * x[i]
            total += a[i, d] * x[i + d]
        y[i] += total
    return y


@compiled(allocates=True, **OPTIONS)
def solve_refined(hessian, factors, first, right):
    """Solve for right-hand sides (n, k) on rows first .. first + n - 1, with one refinement.

    Pivots may be small, since they are not chosen; the refinement restores the digits.
    """
    count, columns = right.shape
    last = first + count
    x = np.empty(right.shape)
    work = np.empty(last + WIDTH)
    for c in range(columns):
        for i in range(count):
            work[first + i] = right[i, c]
        solve(factors, first, last, work)
        for i in range(count):
            x[i, c] = work[first + i]
        product = multiply(hessian, first, last, work)
        for i in range(count):
            work[first + i] = right[i, c] - product[first + i]
        solve(factors, first, last, work)
        for i in range(count):
            x[i, c] += work[first + i]
    return x
