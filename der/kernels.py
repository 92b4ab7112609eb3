"""Compiled kernels of the discrete elastic rod (paper, section 3.2).

A rod has N nodes and N - 1 edges.  Unknowns are interleaved node by node, four a node:
``q = [x_0, theta^0, x_1, theta^1, ...]``, so that a node's energy couples 11 consecutive
unknowns and the Hessian has a half-bandwidth of 10.  The last angle does not exist; its slot is
kept to make all rows alike.

The state of a rod is (x, m1, twist): positions (N, 3), the material director m1 (the surface
normal) of each edge (N - 1, 3), and the twist angle at each node (N,), kept because an angle
alone is known up to full turns only.  Directors are moved by parallel transport in time, and
m2 = t x m1 points along the width, so that bending about m1 is the stiff one.  Angles theta are
therefore increments: a variation of x leaves the frames parallel (Bergou et al. 2010).

Units: lengths L, energies EI2/L.  ``rod`` holds the stiffnesses: (EI1, EI2, GJ) over EI2,
``rest`` the rest length of an edge, ``stretch`` (N - 1,) the stretching stiffness EA of each
edge times its share of the length (0 for the clamped ones).

All kernels of the package live here: the compiler's cache does not see a change in another
file.
"""

from __future__ import annotations

import math
from collections import namedtuple

import numpy as np

from ribbonfem.compiled.decorator import compiled

WIDTH = 10  # half-bandwidth
FIRST = 7  # first free unknown: theta^1; the last is theta^(N-3), number 4 N - 9

OPTIONS = {"fastmath": {"contract"}, "error_model": "numpy"}


@compiled(**OPTIONS)
def _cross(a, b):
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@compiled(**OPTIONS)
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled(**OPTIONS)
def _sum(a, p, b, q):
    """p a + q b."""
    return (p * a[0] + q * b[0], p * a[1] + q * b[1], p * a[2] + q * b[2])


@compiled(**OPTIONS)
def _row(array, i):
    return (array[i, 0], array[i, 1], array[i, 2])


@compiled(**OPTIONS)
def edges(x, tangent, inverse):
    """Unit tangents (N - 1, 3) and inverse lengths (N - 1,) of the edges."""
    for i in range(tangent.shape[0]):
        e = _sum(_row(x, i + 1), 1.0, _row(x, i), -1.0)
        length = 1.0 / math.sqrt(_dot(e, e))
        inverse[i] = length
        tangent[i, 0], tangent[i, 1], tangent[i, 2] = e[0] * length, e[1] * length, e[2] * length


@compiled(**OPTIONS)
def _turned(m, t, angle):
    """m, normal to t, turned about t."""
    square = angle * angle
    if square < 2.5e-3:
        # series to rounding: an angle of a step is small, and the library's functions are not cheap
        c = 1.0 - square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0)))
        s = angle * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0 - square * (1.0 / 5040.0))))
    else:
        c, s = math.cos(angle), math.sin(angle)
    return _sum(m, c, _cross(t, m), s)


@compiled(**OPTIONS)
def _angle_of(y, x):
    """atan2(y, x), by its series where y is small."""
    if x > 0.0 and abs(y) < 0.1 * x:
        z = y / x
        w = z * z
        series = 1.0 / 9.0 - w * (1.0 / 11.0 - w * (1.0 / 13.0))
        return z * (1.0 - w * (1.0 / 3.0 - w * (1.0 / 5.0 - w * (1.0 / 7.0 - w * series))))
    return math.atan2(y, x)


@compiled(**OPTIONS)
def carry(tangent_old, m1_old, twist_old, tangent, turn, m1, twist):
    """Carry the directors from one configuration's tangents to another's.

    Each m1 is transported parallel from the old tangent of its edge to the new one and then
    turned by `turn` (N,) about it; the twist is measured anew and kept on the turn nearest to
    the old one.  Writes m1 and twist; they may be the old arrays.
    """
    before = (0.0, 0.0, 0.0)
    director = (0.0, 0.0, 0.0)
    for i in range(m1.shape[0]):
        old, new = _row(tangent_old, i), _row(tangent, i)
        m = _row(m1_old, i)
        m = _sum(m, 1.0, _sum(old, 1.0, new, 1.0), -_dot(m, new) / (1.0 + _dot(old, new)))
        m = _turned(m, new, turn[i])
        # back onto the normal plane and to unit length: a Newton step, since it is off by rounding
        m = _sum(m, 1.0, new, -_dot(m, new))
        m = _sum(m, 1.5 - 0.5 * _dot(m, m), m, 0.0)
        if i > 0:
            # m1 of the edge before, transported in space onto this edge
            both = _sum(before, 1.0, new, 1.0)
            moved = _sum(director, 1.0, both, -_dot(director, new) / (1.0 + _dot(before, new)))
            angle = _angle_of(-_dot(moved, _cross(new, m)), _dot(moved, m))
            off = twist_old[i] - angle
            if abs(off) > math.pi:
                angle += 2.0 * math.pi * round(off / (2.0 * math.pi))
            twist[i] = angle
        m1[i, 0], m1[i, 1], m1[i, 2] = m
        before, director = new, m


@compiled(**OPTIONS)
def assemble(
    tangent, inverse, m1, twist, stiffness, rest, stretch, gradient, hessian, energies, second, nodes
):
    """Energy and its first and second derivatives, from the edges and directors of a configuration.

    Writes gradient (4 N,), hessian (4 N + 10, 11) with hessian[i, d] = H[i + d, i], and
    energies (3,): stretching, bending, twisting.  The Hessian is the symmetric part of the
    derivative of the gradient; what is left out is the holonomy of the frames times dE/dtheta,
    which vanishes in equilibrium.  Without `second` the Hessian is not touched.  Only the terms
    of the first `nodes` nodes are summed: 4 suffice for the reaction of the left clamp.
    """
    gradient[: 4 * nodes] = 0.0
    if second:
        hessian[:] = 0.0
    bend_1, bend_2, turn = stiffness[0] / rest, stiffness[1] / rest, stiffness[2] / rest
    stretching = bending = twisting = 0.0

    te, ie = _row(tangent, 0), inverse[0]
    m1e = _row(m1, 0)
    m2e = _cross(te, m1e)
    for i in range(1, nodes - 1):
        tf, i_f = _row(tangent, i), inverse[i]
        m1f = _row(m1, i)
        m2f = _cross(tf, m1f)
        chi = 1.0 + _dot(te, tf)
        ix = 1.0 / chi
        kb = _cross(te, tf)
        kb = (2.0 * ix * kb[0], 2.0 * ix * kb[1], 2.0 * ix * kb[2])
        tt = _sum(te, ix, tf, ix)
        n1 = _sum(m1e, ix, m1f, ix)
        n2 = _sum(m2e, ix, m2f, ix)
        kappa_1 = 0.5 * chi * _dot(kb, n1)
        kappa_2 = 0.5 * chi * _dot(kb, n2)
        a1, a2, at = bend_1 * kappa_1, bend_2 * kappa_2, turn * twist[i]
        bending += 0.5 * (a1 * kappa_1 + a2 * kappa_2)
        twisting += 0.5 * at * twist[i]
        p1, p2 = _cross(tf, n1), _cross(tf, n2)
        q1, q2 = _cross(te, n1), _cross(te, n2)
        # derivatives of the curvatures in the two edge vectors and the two angles
        g1e = (ie * (p1[0] - kappa_1 * tt[0]), ie * (p1[1] - kappa_1 * tt[1]), ie * (p1[2] - kappa_1 * tt[2]))
        g2e = (ie * (p2[0] - kappa_2 * tt[0]), ie * (p2[1] - kappa_2 * tt[1]), ie * (p2[2] - kappa_2 * tt[2]))
        g1f = (
            -i_f * (q1[0] + kappa_1 * tt[0]),
            -i_f * (q1[1] + kappa_1 * tt[1]),
            -i_f * (q1[2] + kappa_1 * tt[2]),
        )
        g2f = (
            -i_f * (q2[0] + kappa_2 * tt[0]),
            -i_f * (q2[1] + kappa_2 * tt[1]),
            -i_f * (q2[2] + kappa_2 * tt[2]),
        )
        k1e, k2e = 0.5 * _dot(kb, m2e), -0.5 * _dot(kb, m1e)
        k1f, k2f = 0.5 * _dot(kb, m2f), -0.5 * _dot(kb, m1f)

        b = 4 * (i - 1)
        half_e, half_f = 0.5 * at * ie, 0.5 * at * i_f
        for c in range(3):
            de = a1 * g1e[c] + a2 * g2e[c] + half_e * kb[c]
            df = a1 * g1f[c] + a2 * g2f[c] + half_f * kb[c]
            gradient[b + c] -= de
            gradient[b + 4 + c] += de - df
            gradient[b + 8 + c] += df
        gradient[b + 3] += a1 * k1e + a2 * k2e - at
        gradient[b + 7] += a1 * k1f + a2 * k2f + at

        # the edge after the node also carries its stretching
        along = across = 0.0
        if stretch[i] > 0.0:
            strain = 1.0 / (i_f * rest) - 1.0
            force = stretch[i] / rest * strain
            stretching += 0.5 * stretch[i] * strain * strain
            for c in range(3):
                gradient[b + 4 + c] -= force * tf[c]
                gradient[b + 8 + c] += force * tf[c]
            across = force * i_f
            along = stretch[i] / (rest * rest) - across

        if second:
            de_ = _sum(m1e, a1, m2e, a2)
            df_ = _sum(m1f, a1, m2f, a2)
            c = a1 * kappa_1 + a2 * kappa_2
            cx = c * ix
            u = _sum(tt, c, _sum(p1, a1, p2, a2), -1.0)
            w = _sum(tt, c, _sum(q1, a1, q2, a2), 1.0)
            ve = _sum(_sum(de_, 0.25, kb, 0.125 * turn), 1.0, _sum(te, 1.0, tt, 1.0), -0.25 * at)
            vf = _sum(_sum(df_, 0.25, kb, 0.125 * turn), 1.0, _sum(tf, 1.0, tt, 1.0), -0.25 * at)
            # skew part of the mixed block: [z]x
            z = _sum(_sum(de_, ix, df_, ix), -1.0, tt, 0.5 * at)
            kv = _sum(kb, 0.25 * turn, tt, -0.25 * at)
            ee, ef, ff = ie * ie, ie * i_f, i_f * i_f
            b1e = (bend_1 * g1e[0], bend_1 * g1e[1], bend_1 * g1e[2])
            b2e = (bend_2 * g2e[0], bend_2 * g2e[1], bend_2 * g2e[2])
            b1f = (bend_1 * g1f[0], bend_1 * g1f[1], bend_1 * g1f[2])
            b2f = (bend_2 * g2f[0], bend_2 * g2f[1], bend_2 * g2f[2])
            skew = ((0.0, -z[2], z[1]), (z[2], 0.0, -z[0]), (-z[1], z[0], 0.0))
            for r in range(3):
                for s in range(3):
                    mixed = (
                        ef
                        * (
                            tt[r] * w[s]
                            + u[r] * tt[s]
                            - cx * te[r] * tf[s]
                            + kb[r] * kv[s]
                            - 0.25 * at * tt[r] * kb[s]
                            + skew[r][s]
                        )
                        + b1e[r] * g1f[s]
                        + b2e[r] * g2f[s]
                    )
                    if r == s:
                        mixed -= ef * cx
                    # x_(i-1) with x_(i+1)
                    hessian[b + r, 8 + s - r] -= mixed
                    # x_(i-1) with x_i
                    hessian[b + r, 4 + s - r] += mixed
                    # x_i with x_(i+1)
                    hessian[b + 4 + r, 4 + s - r] += mixed
                    # x_i with itself: minus the mixed block and its transpose, lower triangle
                    if r >= s:
                        hessian[b + 4 + s, r - s] -= mixed
                    if s >= r:
                        hessian[b + 4 + r, s - r] -= mixed
                for s in range(r + 1):
                    left = (
                        ee
                        * (tt[r] * u[s] + u[r] * tt[s] + kb[r] * ve[s] + ve[r] * kb[s] + cx * te[r] * te[s])
                        + b1e[r] * g1e[s]
                        + b2e[r] * g2e[s]
                    )
                    right = (
                        ff
                        * (tt[r] * w[s] + w[r] * tt[s] + kb[r] * vf[s] + vf[r] * kb[s] + cx * tf[r] * tf[s])
                        + b1f[r] * g1f[s]
                        + b2f[r] * g2f[s]
                        + along * tf[r] * tf[s]
                    )
                    if r == s:
                        left -= ee * cx
                        right += across - ff * cx
                    hessian[b + s, r - s] += left
                    hessian[b + 4 + s, r - s] += left + right
                    hessian[b + 8 + s, r - s] += right
                    hessian[b + s, 4 + r - s] -= left
                    hessian[b + 4 + s, 4 + r - s] -= right
                    if r != s:
                        hessian[b + r, 4 + s - r] -= left
                        hessian[b + 4 + r, 4 + s - r] -= right
            # angles
            le = _sum(m2e, a1, m1e, -a2)
            lf = _sum(m2f, a1, m1f, -a2)
            he, hf = 0.5 * _dot(kb, le), 0.5 * _dot(kb, lf)
            fe, ff_ = _cross(tf, le), _cross(tf, lf)
            ge, gf = _cross(te, le), _cross(te, lf)
            for r in range(3):
                half = 0.5 * turn * kb[r]
                ee_ = ie * (ix * fe[r] - he * tt[r] - half) + b1e[r] * k1e + b2e[r] * k2e
                ef_ = ie * (ix * ff_[r] - hf * tt[r] + half) + b1e[r] * k1f + b2e[r] * k2f
                fe_ = -i_f * (ix * ge[r] + he * tt[r] + half) + b1f[r] * k1e + b2f[r] * k2e
                fff = -i_f * (ix * gf[r] + hf * tt[r] - half) + b1f[r] * k1f + b2f[r] * k2f
                hessian[b + r, 3 - r] -= ee_
                hessian[b + 3, 1 + r] += ee_ - fe_
                hessian[b + 3, 5 + r] += fe_
                hessian[b + r, 7 - r] -= ef_
                hessian[b + 4 + r, 3 - r] += ef_ - fff
                hessian[b + 7, 1 + r] += fff
            hessian[b + 3, 0] += bend_1 * k1e * k1e + bend_2 * k2e * k2e + turn - 0.5 * _dot(kb, de_)
            hessian[b + 7, 0] += bend_1 * k1f * k1f + bend_2 * k2f * k2f + turn - 0.5 * _dot(kb, df_)
            hessian[b + 3, 4] += bend_1 * k1e * k1f + bend_2 * k2e * k2f - turn
        te, ie, m1e, m2e = tf, i_f, m1f, m2f
    energies[0] = stretching
    energies[1] = bending
    energies[2] = twisting


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


@compiled(**OPTIONS)
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


@compiled(**OPTIONS)
def solve_refined(hessian, factors, first, right):
    """Solve for right-hand sides (n, k) on rows first .. first + n - 1, with one refinement.

    Pivots may be small, since they are not chosen; the refinement restores the digits.
    """
    count, columns = right.shape
    last = first + count
    x = np.empty(right.shape)
    work = np.empty(last + WIDTH)
    for c in range(columns):
        work[first:last] = right[:, c]
        solve(factors, first, last, work)
        x[:, c] = work[first:last]
        product = multiply(hessian, first, last, work)
        for i in range(count):
            work[first + i] = right[i, c] - product[first + i]
        solve(factors, first, last, work)
        for i in range(count):
            x[i, c] += work[first + i]
    return x


# ---------------------------------------------------------------------------------------------
# motion

IMPLICIT_EULER, NEWMARK, GENERALISED_ALPHA, MIDPOINT, DISCRETE_GRADIENT, RUNGE_KUTTA, VERLET = range(7)
DONE, FULL, STUCK, BLOWN = range(4)

# what `clock` holds between calls of `run`
(
    TIME,
    STEP,
    DISSIPATED,
    WORK,
    POWER,
    STEPS,
    ITERATIONS,
    REJECTED,
    ROW,
    SINCE,
    ASSEMBLIES,
    FACTORED,
    START,
    EFFORT,
    AFTER,
    SIDE,
    CARRY,
) = range(17)
CLOCK_SIZE = 17
# L; the height has left zero, and may cross it, once it is this far from it: rounding is not
DEPARTED = 1e-6
# see `run`: lengths per t* below which the error allowed in a step shrinks with the speed, over 1
CREEP = 0.1
# growth of the energy, over that of the start and the work done, at which a run is stopped
GROWTH = 0.25

# columns of `rows`
ROW_TIME, ROW_ANGLE, ROW_HEIGHT, ROW_SLOPE, ROW_KINETIC, ROW_ELASTIC, ROW_DISSIPATED, ROW_WORK = range(8)
ROW_LOAD, ROW_SIZE = 8, 9

Rod = namedtuple("Rod", "stiffness rest stretch inertia arclength")
# rate, stop (rad, along the rate), end (time), nu; all in units of t*; the energy below which a
# held ribbon cannot leave its state any more, and its run ends; whether to end soon after the height
# changes sign
Ramp = namedtuple("Ramp", "rate stop end damping barrier snap")
# method, step (0: adaptive), tolerance (of positions), newton (of updates), largest, smallest, radius; of
# a Runge-Kutta method its table (stages, stages), whose last row is the step's weights, its instants, the
# weights (stages,) of its error and the power of the step in that
Policy = namedtuple(
    "Policy", "method step tolerance newton largest smallest radius table instants weights power"
)
# the motion: positions, velocities and accelerations of all unknowns; aux is the acceleration-like
# variable of generalised-alpha and the mean velocity of midpoint's last step; frames
Motion = namedtuple("Motion", "x v a aux tangent m1 twist clock")
# arrays that a step overwrites
Scratch = namedtuple(
    "Scratch",
    "x tangent inverse m1 twist dq stage_v stage_a v b gradient gradient1 hessian factors right energies "
    "turn",
)


@compiled(**OPTIONS)
def _sum_up(rod, m1, twist, s, second, nodes):
    """`assemble` for the edges in s.tangent and s.inverse, into s.gradient, s.factors, s.energies."""
    assemble(
        s.tangent,
        s.inverse,
        m1,
        twist,
        rod.stiffness,
        rod.rest,
        rod.stretch,
        s.gradient,
        s.factors,
        s.energies,
        second,
        nodes,
    )


@compiled(**OPTIONS)
def _place(rod, angle, x0, dq):
    """Increments of the left clamp's two nodes to an angle."""
    for i in range(2):
        for c, direction in enumerate((math.cos(angle), 0.0, -math.sin(angle))):
            dq[4 * i + c] = rod.arclength[i] * direction - x0[i, c]


@compiled(**OPTIONS)
def _configure(motion, s, dq, share):
    """The configuration s.x, its edges and frames, at a share of the increments dq of a step."""
    nodes = motion.x.shape[0]
    for i in range(nodes):
        for c in range(3):
            s.x[i, c] = motion.x[i, c] + share * dq[4 * i + c]
        s.turn[i] = share * dq[4 * i + 3]
    edges(s.x, s.tangent, s.inverse)
    carry(motion.tangent, motion.m1, motion.twist, s.tangent, s.turn, s.m1, s.twist)


@compiled(**OPTIONS)
def _evaluate(rod, motion, s, dq, mean, second):
    """Forces in s.gradient, and with `second` their derivative in dq in s.factors.

    At the end of the increments dq or, if `mean`, their mean along the straight path to there:
    three Gauss points balance the energy of a step to the sixth power of the increments.
    """
    nodes = motion.x.shape[0]
    if mean:
        s.gradient1[:] = 0.0
        if second:
            s.hessian[:] = 0.0
    for k in range(3 if mean else 1):
        point = 0.5 + 0.3872983346207417 * (k - 1) if mean else 1.0
        _configure(motion, s, dq, point)
        _sum_up(rod, s.m1, s.twist, s, second, nodes)
        if mean:
            weight = (4.0 if k == 1 else 2.5) / 9.0
            for i in range(4 * nodes):
                s.gradient1[i] += weight * s.gradient[i]
            if second:
                for i in range(4 * nodes):
                    for d in range(WIDTH + 1):
                        s.hessian[i, d] += weight * point * s.factors[i, d]
    if mean:
        s.gradient[:] = s.gradient1
        if second:
            s.factors[:] = s.hessian


@compiled(**OPTIONS)
def _newton(rod, motion, s, dq, c, b, policy):
    """Solve M (c dq - b) + F = 0 for the free increments, from the guess in dq; F as in `_evaluate`.

    Returns the iterations, negative if they did not converge.  A factorisation is kept from one
    iteration to the next, and from one step to the next while c stays, as long as the updates
    fall to a tenth each time: most of the cost is in making it.
    """
    nodes = motion.x.shape[0]
    first, last = FIRST, 4 * nodes - 8
    mean = policy.method == DISCRETE_GRADIENT
    before = 0.0
    fresh = motion.clock[FACTORED] != c
    made = 0
    for iteration in range(1, 31):
        _evaluate(rod, motion, s, dq, mean, fresh)
        if fresh:
            motion.clock[ASSEMBLIES] += 1
            motion.clock[FACTORED] = c
            made += 1
            for i in range(first, last):
                s.factors[i, 0] += c * rod.inertia[i]
            factor(s.factors, first, last)
        for i in range(first, last):
            s.right[i] = rod.inertia[i] * (b[i] - c * dq[i]) - s.gradient[i]
        solve(s.factors, first, last, s.right)
        size = 0.0
        for i in range(first, last):
            # an angle counts as a tenth of a length: the half width of the ribbon
            size = max(size, abs(s.right[i]) if i % 4 != 3 else 0.1 * abs(s.right[i]))
        if not fresh and (not size < 0.5 or (iteration > 1 and size > before)):
            # the old factors are no good here: take no step with them
            fresh = True
            continue
        # NaN fails this comparison too
        if not size < 0.5 or made > 15:
            motion.clock[FACTORED] = 0.0
            return -iteration
        for i in range(first, last):
            dq[i] += s.right[i]
        if size < policy.newton:
            return iteration
        fresh = iteration > 1 and size > 0.1 * before
        before = size
    motion.clock[FACTORED] = 0.0
    return -30


@compiled(**OPTIONS)
def _largest(values, first, last):
    """Largest component of the positions among interleaved values."""
    size = 0.0
    for i in range(first, last):
        if i % 4 != 3:
            size = max(size, abs(values[i]))
    return size


@compiled(**OPTIONS)
def _angle(ramp, time):
    """Clamp angle at a time; exactly `stop` from the kink on."""
    turned = abs(ramp.rate) * time
    return math.copysign(min(turned, abs(ramp.stop)), ramp.rate)


@compiled(**OPTIONS)
def _attempt(rod, motion, s, ramp, policy, h):
    """One step of size h from `motion`: increments in s.dq, velocities in s.v.

    Returns (iterations, local error of the positions); negative iterations mean failure.
    """
    nodes = motion.x.shape[0]
    first, last = FIRST, 4 * nodes - 8
    nu, time = ramp.damping, motion.clock[TIME]
    v0, a0, aux = motion.v, motion.a, motion.aux
    method = policy.method
    error = 0.0
    if method == VERLET:
        # kicks with the damping taken implicitly at the end: second order, and stable in nu
        for i in range(first, last):
            s.v[i] = v0[i] + 0.5 * h * a0[i]
            s.dq[i] = h * s.v[i]
        _place(rod, _angle(ramp, time + h), motion.x, s.dq)
        if not _largest(s.dq, first, last) < 0.5:
            return -1, error
        _configure(motion, s, s.dq, 1.0)
        _sum_up(rod, s.m1, s.twist, s, False, nodes)
        for i in range(first, last):
            s.v[i] = (s.v[i] - 0.5 * h * s.gradient[i] / rod.inertia[i]) / (1.0 + 0.5 * h * nu)
        return 1, error

    if method == RUNGE_KUTTA:
        table, stages = policy.table, policy.table.shape[0]
        for i in range(first, last):
            s.stage_v[0, i] = v0[i]
            s.stage_a[0, i] = a0[i]
        count = 0
        for k in range(1, stages):
            dh = table[k, k] * h
            c = 1.0 / (dh * dh) + nu / dh
            for i in range(first, last):
                # what the stage knows: velocity v + dh a, increment dq + dh^2 a
                known, moved = v0[i], 0.0
                for j in range(k):
                    known += h * table[k, j] * s.stage_a[j, i]
                    moved += h * table[k, j] * s.stage_v[j, i]
                moved += dh * known
                s.stage_v[k, i] = known
                s.stage_a[k, i] = moved
                s.b[i] = c * moved - nu * known
                s.dq[i] = moved + dh * dh * s.stage_a[k - 1, i]
            _place(rod, _angle(ramp, time + policy.instants[k] * h), motion.x, s.dq)
            used = _newton(rod, motion, s, s.dq, c, s.b, policy)
            if used < 0:
                return used - count, error
            count += used
            for i in range(first, last):
                acceleration = (s.dq[i] - s.stage_a[k, i]) / (dh * dh)
                s.stage_a[k, i] = acceleration
                s.stage_v[k, i] += dh * acceleration
        for i in range(first, last):
            s.v[i] = s.stage_v[stages - 1, i]
            if i % 4 != 3:
                estimate = 0.0
                for k in range(stages):
                    estimate += policy.weights[k] * s.stage_v[k, i]
                error = max(error, h * abs(estimate))
        return count, error

    beta, gamma, am, af = 0.25, 0.5, 0.0, 0.0
    if method == GENERALISED_ALPHA:
        am = (2.0 * policy.radius - 1.0) / (policy.radius + 1.0)
        af = policy.radius / (policy.radius + 1.0)
        gamma = 0.5 - am + af
        beta = 0.25 * (1.0 - am + af) ** 2
    if method == IMPLICIT_EULER:
        c = 1.0 / (h * h) + nu / h
        for i in range(first, last):
            s.b[i] = v0[i] / h
            s.dq[i] = h * (v0[i] + h * a0[i])
    elif method == MIDPOINT or method == DISCRETE_GRADIENT:
        c = 2.0 / (h * h) + nu / h
        for i in range(first, last):
            s.b[i] = 2.0 * v0[i] / h
            # the mean velocity of the step before: end velocities ring along the ribbon
            s.dq[i] = h * aux[i]
        if method == MIDPOINT:
            # the unknown of the stage is the half increment
            c *= 2.0
            for i in range(first, last):
                s.dq[i] *= 0.5
    else:
        ratio = (1.0 - am) / (1.0 - af)
        c = ratio / (beta * h * h) + nu * gamma / (beta * h)
        for i in range(first, last):
            # a1 = dq / (beta h^2) - old, v1 = known + gamma h a1
            old = v0[i] / (beta * h) + (0.5 / beta - 1.0) * aux[i]
            known = v0[i] + h * (1.0 - gamma) * aux[i]
            s.b[i] = ratio * old - nu * (known - gamma * h * old) - (am * aux[i] - af * a0[i]) / (1.0 - af)
            s.dq[i] = h * (v0[i] + 0.5 * h * a0[i])
    inner = 0.5 * h if method == MIDPOINT else h
    _place(rod, _angle(ramp, time + inner), motion.x, s.dq)
    count = _newton(rod, motion, s, s.dq, c, s.b, policy)
    if count < 0:
        return count, error
    if method == MIDPOINT:
        for i in range(first, last):
            s.dq[i] *= 2.0
        _place(rod, _angle(ramp, time + h), motion.x, s.dq)
    # constants of the local error h^3 q''' (implicit Euler: h^2 q'') of each method
    if method == IMPLICIT_EULER:
        for i in range(first, last):
            s.v[i] = s.dq[i] / h
            if i % 4 != 3:
                error = max(error, 0.5 * h * abs(s.v[i] - v0[i]))
    elif method == MIDPOINT or method == DISCRETE_GRADIENT:
        for i in range(first, last):
            s.v[i] = 2.0 * s.dq[i] / h - v0[i]
    else:
        constant = abs(beta - 1.0 / 6.0 + 0.5 * (am - af))
        for i in range(first, last):
            a1 = (s.dq[i] / h - v0[i]) / (beta * h) - (0.5 / beta - 1.0) * aux[i]
            s.v[i] = v0[i] + h * ((1.0 - gamma) * aux[i] + gamma * a1)
            if i % 4 != 3:
                error = max(error, constant * h * h * abs(a1 - aux[i]))
    return count, error


@compiled(**OPTIONS)
def _moment(rod, gradient, angle):
    """Moment (of the clamp on the ribbon, along growing angle) from the reaction of the left nodes."""
    total = 0.0
    for i in range(2):
        total += rod.arclength[i] * (
            -math.sin(angle) * gradient[4 * i] - math.cos(angle) * gradient[4 * i + 2]
        )
    return total


@compiled(**OPTIONS)
def _accept(rod, motion, s, ramp, policy, h):
    """Take over the step in s.dq, s.v: frames, accelerations, energies passed on."""
    nodes = motion.x.shape[0]
    first, last = FIRST, 4 * nodes - 8
    clock, nu, method = motion.clock, ramp.damping, policy.method
    v0, a0, aux = motion.v, motion.a, motion.aux
    lost = 0.0
    for i in range(first, last):
        mean = s.dq[i] / h
        inner = 1.5 * mean - 0.25 * (v0[i] + s.v[i])
        lost += rod.inertia[i] * (v0[i] * v0[i] + 4.0 * inner * inner + s.v[i] * s.v[i])
    clock[DISSIPATED] += nu * h * lost / 6.0
    _configure(motion, s, s.dq, 1.0)
    before, after = _angle(ramp, clock[TIME]), _angle(ramp, clock[TIME] + h)
    whole = method == VERLET
    _sum_up(rod, s.m1, s.twist, s, False, nodes if whole else 4)
    power = _moment(rod, s.gradient, after)
    work = 0.5 * (clock[POWER] + power) * (after - before)
    clock[WORK] += work
    clock[EFFORT] += abs(work)
    clock[POWER] = power
    am, af = 0.0, 0.0
    if method == GENERALISED_ALPHA:
        am = (2.0 * policy.radius - 1.0) / (policy.radius + 1.0)
        af = policy.radius / (policy.radius + 1.0)
    gamma = 0.5 - am + af
    for i in range(first, last):
        if whole:
            a1 = -nu * s.v[i] - s.gradient[i] / rod.inertia[i]
        elif method == RUNGE_KUTTA:
            a1 = s.stage_a[policy.table.shape[0] - 1, i]
        elif method == IMPLICIT_EULER:
            a1 = (s.v[i] - v0[i]) / h
        elif method == MIDPOINT or method == DISCRETE_GRADIENT:
            a1 = 0.0
            aux[i] = s.dq[i] / h
        else:
            new = (s.v[i] - v0[i] - h * (1.0 - gamma) * aux[i]) / (gamma * h)
            a1 = ((1.0 - am) * new + am * aux[i] - af * a0[i]) / (1.0 - af)
            aux[i] = new
        a0[i] = a1
        v0[i] = s.v[i]
    motion.x[:] = s.x
    motion.tangent[:] = s.tangent
    motion.m1[:] = s.m1
    motion.twist[:] = s.twist


@compiled(**OPTIONS)
def _record(rod, motion, s, ramp, rows, row_x, row_m1):
    """Write the next row; configurations only if there is room for them.  True if the energy has blown up."""
    nodes = motion.x.shape[0]
    clock, row = motion.clock, int(motion.clock[ROW])
    edges(motion.x, s.tangent, s.inverse)
    _sum_up(rod, motion.m1, motion.twist, s, False, nodes)
    kinetic = 0.0
    for i in range(FIRST, 4 * nodes - 8):
        kinetic += 0.5 * rod.inertia[i] * motion.v[i] * motion.v[i]
    half = (nodes - 1) // 2
    height, slope = motion.x[half, 2], s.tangent[half, 2]
    if nodes % 2:
        both = _sum(_row(s.tangent, half - 1), 1.0, _row(s.tangent, half), 1.0)
        slope = both[2] / math.sqrt(_dot(both, both))
    else:
        x = motion.x
        height = 0.5625 * (x[half, 2] + x[half + 1, 2]) - 0.0625 * (x[half - 1, 2] + x[half + 2, 2])
    rows[row, ROW_TIME] = clock[TIME]
    rows[row, ROW_ANGLE] = _angle(ramp, clock[TIME])
    rows[row, ROW_HEIGHT] = height
    rows[row, ROW_SLOPE] = slope
    rows[row, ROW_KINETIC] = kinetic
    rows[row, ROW_ELASTIC] = s.energies[0] + s.energies[1] + s.energies[2]
    rows[row, ROW_DISSIPATED] = clock[DISSIPATED]
    rows[row, ROW_WORK] = clock[WORK]
    # the compressive force along x, averaged over the free edges
    force, load = 0.0, 0.0
    for i in range(nodes - 1, 1, -1):
        force += s.gradient[4 * i]
        if i < nodes - 1:
            load -= force
    rows[row, ROW_LOAD] = load / (nodes - 3)
    if row < row_x.shape[0]:
        row_x[row] = motion.x
        row_m1[row] = motion.m1
    clock[ROW] += 1.0
    held = kinetic + rows[row, ROW_ELASTIC] - clock[WORK]
    if clock[STEPS] == 0.0:
        clock[START] = held
    # Energy from nowhere: what follows would be no motion of this ribbon.  What the damping took is
    # left out of the balance: long steps do not resolve it, and it can only make room.
    return not held - clock[START] <= GROWTH * (clock[START] + clock[EFFORT])


@compiled(**OPTIONS)
def run(rod, motion, s, ramp, policy, every, rows, row_x, row_m1):
    """Step until the end of the ramp and its hold, until decided or snapped (DONE), until the rows are full
    (FULL), no step converges (STUCK), or the energy grows from nowhere (BLOWN).

    All the state is in `motion`, so that a call after FULL, with fresh rows, goes on.  Every
    `every`-th accepted step and the last one make a row.
    """
    nodes = motion.x.shape[0]
    clock = motion.clock
    kink = abs(ramp.stop / ramp.rate)
    order = 1.0 / policy.power
    while True:
        if clock[ROW] >= rows.shape[0]:
            return FULL
        time = clock[TIME]
        target = kink if time < kink else ramp.end
        h = min(clock[STEP], policy.largest)
        # half a rad at most: transport of frames needs neighbours
        h = min(h, 0.5 / abs(ramp.rate)) if time < kink else h
        # no sliver of a step is left: it would tell nothing, and spoil what is interpolated over it
        landing = target - time <= h * (1.0 + (1e-6 if policy.step > 0.0 else 1e-3))
        if landing:
            h = target - time
        count, error = _attempt(rod, motion, s, ramp, policy, h)
        clock[ITERATIONS] += abs(count)
        failed = count < 0
        if policy.step > 0.0:
            error = 0.0
        else:
            # Errors made while the ribbon creeps towards a fold add up and shift the snap; those
            # made while it rings do not.  The error allowed shrinks with the speed.
            speed = _largest(s.v, FIRST, 4 * nodes - 8)
            error /= min(1.0, max(0.01, CREEP * speed))
            if not failed and not error <= policy.tolerance:
                failed = True
        if failed:
            clock[REJECTED] += 1.0
            if count < 0:
                h *= 0.5
            else:
                h *= max(0.2, 0.9 * (policy.tolerance / error) ** order)
            clock[STEP] = h
            if h < policy.smallest:
                return STUCK
            continue
        _accept(rod, motion, s, ramp, policy, h)
        # what rounding leaves of the sum of many equal steps is carried on: they are to land on the target
        lost = h + clock[CARRY]
        clock[TIME] = target if landing else time + lost
        clock[CARRY] = 0.0 if landing else lost - (clock[TIME] - time)
        clock[STEPS] += 1.0
        clock[SINCE] += 1.0
        if policy.step > 0.0:
            # after a halving the step grows back to the one asked for; a landing does not count
            clock[STEP] = min(policy.step, 2.0 * clock[STEP])
        else:
            growth = 2.5 if error == 0.0 else min(2.5, max(0.2, 0.9 * (policy.tolerance / error) ** order))
            # a short step onto a kink says nothing of the steps that follow
            clock[STEP] = max(h * growth, clock[STEP] if landing and growth > 1.0 else 0.0)
        done = clock[TIME] >= ramp.end
        if done or clock[SINCE] >= every:
            clock[SINCE] = 0.0
            if _record(rod, motion, s, ramp, rows, row_x, row_m1):
                return BLOWN
            row = int(clock[ROW]) - 1
            if clock[TIME] >= kink and rows[row, ROW_KINETIC] + rows[row, ROW_ELASTIC] < ramp.barrier:
                return DONE
            if ramp.snap:
                if clock[SIDE] == 0.0 and abs(rows[row, ROW_HEIGHT]) > DEPARTED:
                    clock[SIDE] = rows[row, ROW_HEIGHT]
                # two rows on either side of the crossing: it is solved for on a cubic through them
                crossed = clock[SIDE] != 0.0 and rows[row, ROW_HEIGHT] * clock[SIDE] <= 0.0
                if clock[AFTER] > 0.0 or crossed:
                    clock[AFTER] += 1.0
                    if clock[AFTER] >= 2.0:
                        return DONE
        if done:
            return DONE
        if not math.isfinite(motion.v[FIRST]):
            return STUCK
