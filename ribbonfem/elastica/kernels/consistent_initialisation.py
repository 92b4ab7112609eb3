"""Consistent initialisation of the elastica: velocities, accelerations and forces that fit its constraints.

r' = t (1 + c n.t), derived once, is for the velocities, and derived twice for the accelerations:

    D v   = phi_t (1 + c n.t) t_perp
    D v_t = phi_tt (1 + c n.t) t_perp + 2 phi_t (D v . t) t_perp - phi_t^2 (1 + c n.t) t

across the tangent; along it too where the beam does not stretch, and what stretch leaves free stays as it is.
phi has no inertia: a small one is lent to the tangent, and refinement of the solution takes it back.
"""

from __future__ import annotations

from ribbonfem.ends.kernels import COMPRESSION, LEFT, LIFT, RIGHT, Ends
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import INLINED, OPTIONS
from ribbonfem.jit.simd import greatest, larger, load, spread, store
from ribbonfem.linalg.array_ops import copy
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.newton import SIGMA
from ribbonfem.stepping.kernels.strains import know_rates

from .arrays import Motion, Scratch
from .beam import FORCE, PHI, ROWS, WIDTH, Beam, P, Solver, Z
from .condensed import factorise, solve
from .ends import set_places, set_turns
from .gauss_point import Value, cosine_sine, interpolated, resolved
from .law import put_strain_rates, put_strains, stretch_of
from .residual import residual
from .tangent import PENALTY, fill

# refinements of a solution at the most, and the part of it below which a change is none
_MOST, _NONE = 12, 1e-11


@compiled(**INLINED)
def _stretch(beam: Beam, m: Motion, group: int, k: int, tension: Value) -> Value:
    """The length of r' at a Gauss point; of a beam that retards the force does not tell it."""
    if beam.retardation > 0.0:
        return 1.0 + load(m.strain, (group, k, 1))
    return stretch_of(beam, group, k, tension)


@compiled(**INLINED)
def _along_velocity(beam: Beam, v: Array, group: int, k: int) -> tuple[Value, Value]:
    """D v at a Gauss point, without its weight."""
    x = z = spread(0.0)
    for i in range(P + 1):
        x += beam.coupling[k, i] * load(v, (group, i))
        z += beam.coupling[k, i] * load(v, (group, Z + i))
    inverse = 1.0 / beam.weights[k]
    return inverse * x, inverse * z


@compiled(**INLINED)
def _put_gaps(beam: Beam, s: Solver, m: Motion, t: Scratch, second: bool) -> None:
    """What is left over of the constraints, in the rows of n of s.rest.

    Rates of r and phi, and n, are in t.u; m.phi_rate are the rates of phi found first.
    """
    axial = PENALTY if beam.elastic[1] > 0.0 else 0.0
    for group in range(s.rest.shape[0]):
        for k in range(P):
            angle, _, _, _ = interpolated(beam.value, beam.coupling, m.u, group, k)
            rate, _, x, z = interpolated(beam.value, beam.coupling, t.u, group, k)
            cos, sin = cosine_sine(angle)
            tension, _ = resolved(m.u, group, k, cos, sin)
            weight = beam.weights[k]
            stretch = _stretch(beam, m, group, k, tension)
            across, back = stretch * rate, spread(0.0)
            if second:
                turn = spread(0.0)
                for i in range(P + 1):
                    turn += beam.value[k, i] * load(m.phi_rate, (group, i))
                vx, vz = _along_velocity(beam, m.v, group, k)
                across += 2.0 * turn * (vx * cos + vz * sin)
                back = turn * turn * stretch
            held, _ = resolved(t.u, group, k, cos, sin)
            if second:
                # the axial force of the stretched beam does not jump, but for its viscous part
                if beam.retardation > 0.0 and axial > 0.0:
                    tension = (stretch - 1.0 - load(beam.offset, (group, k, 1))) * (1.0 / beam.elastic[1])
                held = held - tension
            back = axial * held - back
            store(s.rest, (group, FORCE + 2 * k), x + weight * (across * sin - back * cos))
            store(s.rest, (group, FORCE + 2 * k + 1), z - weight * (across * cos + back * sin))


@compiled(**INLINED)
def _put_impulses(beam: Beam, s: Solver, m: Motion, t: Scratch, old: Array) -> None:
    """What is left over of the balance of impulses in the other rows: M (v - old) + D^T n, and T^T n."""
    rest = s.rest
    for group in range(rest.shape[0]):
        for k in range(P):
            angle, _, _, _ = interpolated(beam.value, beam.coupling, m.u, group, k)
            cos, sin = cosine_sine(angle)
            tension, _ = resolved(m.u, group, k, cos, sin)
            _, shear = resolved(t.u, group, k, cos, sin)
            store(s.points, (0, k), (beam.weights[k] * _stretch(beam, m, group, k, tension)) * shear)
        for i in range(P + 1):
            x = z = moment = spread(0.0)
            for k in range(P):
                x += beam.coupling[k, i] * load(t.u, (group, FORCE + 2 * k))
                z += beam.coupling[k, i] * load(t.u, (group, FORCE + 2 * k + 1))
                moment -= beam.value[k, i] * load(s.points, (0, k))
            mass = beam.mass[i]
            store(rest, (group, i), x + mass * (load(t.u, (group, i)) - load(old, (group, i))))
            store(rest, (group, Z + i), z + mass * (load(t.u, (group, Z + i)) - load(old, (group, Z + i))))
            store(rest, (group, PHI + i), moment)


@compiled(**INLINED)
def _put_balance(beam: Beam, s: Solver, m: Motion, t: Scratch) -> None:
    """The residual of the equations of motion, of accelerations and forces in t.u."""
    # positions and angles are those of the instant, which the stage's rows take for a moment
    for group in range(s.rest.shape[0]):
        for row in range(PHI):
            store(t.a, (group, row), load(t.u, (group, row)))
            store(t.u, (group, row), load(m.u, (group, row)))
        for i in range(P + 1):
            store(t.rp, (group, i), load(t.u, (group, PHI + i)))
            store(t.u, (group, PHI + i), load(m.u, (group, PHI + i)))
    residual(beam, s, t.u, t.known, 0.0)
    for group in range(s.rest.shape[0]):
        for i in range(P + 1):
            store(t.u, (group, PHI + i), load(t.rp, (group, i)))
        for row in range(PHI):
            acceleration = load(t.a, (group, row))
            store(t.u, (group, row), acceleration)
            mass = beam.mass[row % Z]
            store(s.rest, (group, row), load(s.rest, (group, row)) + mass * acceleration)


@compiled(**INLINED)
def _moved(s: Solver, t: Scratch) -> tuple[float, float]:
    """Add the increments to t.u; the largest change of a rate of phi, and the largest rate."""
    change = size = spread(0.0)
    for group in range(s.rest.shape[0]):
        for row in range(ROWS):
            step = load(s.rest, (group, row))
            new = load(t.u, (group, row)) + step
            store(t.u, (group, row), new)
            if PHI <= row < FORCE:
                change, size = larger(change, step * step), larger(size, new * new)
    return greatest(change), greatest(size)


@compiled(**OPTIONS)
def _impulse(beam: Beam, s: Solver, ends: Ends) -> float:
    """On the control, of the impulses on both clamps in s.rest: what the control's rate moves of them."""
    moved, last = ends.moved, beam.elements - 1
    group, place = last // WIDTH, last % WIDTH
    # (phi of the left clamp is minus its angle)
    total = moved[RIGHT] * s.rest[group, PHI + P, place] - moved[LEFT] * s.rest[0, PHI, 0]
    return total + moved[LIFT] * s.rest[group, Z + P, place] - moved[COMPRESSION] * s.rest[group, P, place]


@compiled(**OPTIONS)
def project(beam: Beam, s: Solver, m: Motion, t: Scratch, ends: Ends, nu: float) -> float:
    """Put v, a and n onto the hidden constraints; return the impulse on the control.

    The velocity nearest to m.v in the kinetic energy, with the clamps as t.controls say; then the
    accelerations and forces that go with it.
    """
    m.clock[SIGMA] = 0.0
    phi_rate = m.phi_rate
    fill(beam, s, m.u, 1.0, True)
    factorise(s)
    if beam.retardation > 0.0:
        put_strains(beam, m.u, m.strain)
    impulse = 0.0
    for second in (False, True):
        for group in range(t.u.shape[0]):
            for row in range(PHI):
                store(t.u, (group, row), load(m.a, (group, row)) if second else load(m.v, (group, row)))
            for i in range(P + 1):
                if second:
                    store(phi_rate, (group, i), load(t.u, (group, PHI + i)))
                store(t.u, (group, PHI + i), spread(0.0))
            for row in range(FORCE, ROWS):
                store(t.u, (group, row), load(m.u, (group, row)) if second else spread(0.0))
        if second and beam.retardation > 0.0:
            put_strain_rates(beam, m.u, m.v, phi_rate, m.strain_rate)
            know_rates(beam, m.strain_rate)
        set_turns(beam, t.controls, 2 if second else 1, t.u)
        set_places(beam, t.controls, 2 if second else 1, t.u)
        for group in range(t.u.shape[0] if second else 0):
            for row in range(PHI):
                loads = load(t.known, (group, row)) - nu * load(m.v, (group, row))
                store(t.known, (group, row), loads)
        for _ in range(_MOST):
            if second:
                _put_balance(beam, s, m, t)
            else:
                _put_impulses(beam, s, m, t, m.v)
                impulse = _impulse(beam, s, ends)
            _put_gaps(beam, s, m, t, second)
            solve(beam, s, 1.0)
            change, size = _moved(s, t)
            if change <= _NONE * _NONE * size:
                break
        for group in range(t.u.shape[0]):
            for row in range(PHI):
                store(m.a if second else m.v, (group, row), load(t.u, (group, row)))
            if second:
                for row in range(FORCE, ROWS):
                    store(m.u, (group, row), load(t.u, (group, row)))
    copy(m.a, m.auxiliary)
    return impulse
