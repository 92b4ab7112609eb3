"""Consistent initialisation of the quasi-linear beam: velocities, accelerations and load fit the clamps.

The ends carry mass, so that a jump of their rates moves their neighbours too.
"""

from __future__ import annotations

from ribbonfem.ends.kernels import COMPRESSION, LEFT, LIFT, RIGHT, Ends
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import OPTIONS
from ribbonfem.linalg.array_ops import copy
from ribbonfem.stepping.kernels.newton import SIGMA

from .bands import add_product, dot, solve_both, widen
from .beam import ENDS, Beam, Motion, Scratch
from .stage import add_ends, at_end, factorise_sum, put_loads, put_product, shortening, square


@compiled(**OPTIONS)
def _bordered(beam: Beam, t: Scratch, last: float) -> float:
    """Solve M x - row y = t.rest, row x = last with the factors; x in t.rest, y returned."""
    solve_both(t.factors, t.pivots, beam.even, t.rest, t.row, t.product, t.column)
    y = (last - dot(t.row, t.product)) / dot(t.row, t.column)
    for i in range(t.rest.shape[0]):
        t.rest[i] = t.product[i] + y * t.column[i]
    return y


@compiled(**OPTIONS)
def project(beam: Beam, m: Motion, t: Scratch, ends: Ends, nu: float) -> float:
    """Put v, a and the load onto the hidden constraints; return the impulse on the control.

    The velocity nearest to m.v in the kinetic energy, with the ends t.ends; then the acceleration and the
    load that go with it.
    """
    n = m.z.shape[0]
    m.clock[SIGMA] = 0.0
    factorise_sum(beam, t, 0.0, 0.0, 1.0)
    put_product(beam.tension, m.z, t.ends[0], t)
    copy(t.product, t.row)
    # M (v - v0) - G Z p = 0 on the free dofs, Z^T G v = the rate of the shortening
    jumps = t.jumps
    off = shortening(beam, t.controls, 1) - dot(t.row, m.v)
    for c in range(ENDS):
        off -= at_end(beam.tension, c, m.z, t.ends[0]) * t.ends[1, c]
        jumps[c] = t.ends[1, c] - m.ends[1, c]
    for i in range(n):
        t.rest[i] = 0.0
    add_ends(beam.mass, -1.0, jumps, t.rest)
    pulse = _bordered(beam, t, off)
    impulse = pulse * ends.moved[COMPRESSION] / (beam.scale * beam.scale)
    for c in range(1, ENDS):
        by = -ends.moved[LEFT] if c == 1 else ends.moved[LIFT] if c == 2 else ends.moved[RIGHT]
        lever = by / beam.scale
        impulse += lever * at_end(beam.mass, c, t.rest, jumps)
        impulse -= lever * at_end(beam.tension, c, m.z, t.ends[0]) * pulse
    for i in range(n):
        m.v[i] += t.rest[i]
    # M (a + nu v) + K Z - sigma^2 G Z = loads, Z^T G a + v^T G v = the second rate of the shortening
    put_loads(beam, t, nu)
    copy(t.loads, t.rest)
    widen(m.z, t.wide)
    add_product(beam.stiffness.band, -1.0, t.wide, t.rest)
    widen(m.v, t.wide)
    add_product(beam.mass.band, -nu, t.wide, t.rest)
    if beam.retardation > 0.0:
        add_product(beam.stiffness.band, -beam.retardation, t.wide, t.rest)
    widen(m.v, t.wide)
    speed = square(beam.tension, m.v, t.wide, t.ends[1])
    off = shortening(beam, t.controls, 2) - speed
    for c in range(ENDS):
        off -= at_end(beam.tension, c, m.z, t.ends[0]) * t.ends[2, c]
    m.load[0] = _bordered(beam, t, off)
    copy(t.rest, m.a)
    copy(t.rest, m.auxiliary)
    copy(t.ends, m.ends)
    return impulse
