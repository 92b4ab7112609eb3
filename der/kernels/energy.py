"""Bending, twist and stretch of a discrete elastic rod: energy, gradient, Hessian, viscous moments.

Inner node i lies between the edges e and f, of tangents t_e, t_f, inverse lengths 1/|e|, 1/|f| and directors
m1, m2; B1, B2, C are EI1, EI2, GJ over l, and S is EA l.  Strains, and their energy:

    (1)  kb = 2 t_e x t_f / chi,  chi = 1 + t_e.t_f,  kappa_c = kb.(m_c^e + m_c^f) / 2,  tau the twist
    (2)  E = sum_i B1 kappa_1^2 / 2 + B2 (kappa_2 - kappa_2^0)^2 / 2 + C (tau - tau^0)^2 / 2
           + sum_f S eps^2 / 2,  eps = |f| / l - 1

With tt = (t_e + t_f) / chi and n_c = (m_c^e + m_c^f) / chi (Bergou et al. 2008, 2010):

    (3)  d kappa_c/de = (t_f x n_c - kappa_c tt) / |e|,  d kappa_c/df = -(t_e x n_c + kappa_c tt) / |f|
    (4)  d kappa_1/d theta = kb.m2 / 2,  d kappa_2/d theta = -kb.m1 / 2, each of its own edge
    (5)  d tau/de = kb / (2 |e|),  d tau/df = kb / (2 |f|),  d tau/d theta = -1 of e, +1 of f

Forces are moments times these.  Of a material that damps (Kelvin-Voigt, a time r) a moment is of the
strain and of its rate, which (3) to (5) make of velocities; where those are pace times increments, the
stiffness counts 1 + r pace times in what is the product of two first derivatives:

    (6)  a_1 = B1 (kappa_1 + r kappa_1'),  a_2 = B2 (kappa_2 - kappa_2^0 + r kappa_2'),
         a_t = C (tau - tau^0 + r tau'),  a_s = S (eps + r eps') / l

    (7)  H = sum of (1 + r pace) B d strain (x) d strain + a d2 strain
"""

from __future__ import annotations

from ribbonfem.jit.algebra import cross, dot, mix, scaled, triple
from ribbonfem.jit.decorator import compiled

from .frames import OPTIONS


@compiled(**OPTIONS)
def assemble(
    material, tangent, inverse, m1, twist, viscous, rise, gradient, hessian, energies, second, nodes
):
    """Energy and its first and second derivatives, from the edges and directors of a configuration.

    Writes gradient (4 N,), hessian (4 N + 10, 11) with hessian[i, d] = H[i + d, i], and
    energies (3,): stretching, bending, twisting.  The Hessian is the symmetric part of the
    derivative of the gradient; what is left out is the holonomy of the frames times dE/dtheta,
    which vanishes in equilibrium.  Without `second` the Hessian is not touched.  Only the terms
    of the first `nodes` nodes are summed: 4 suffice for the reaction of the left clamp.

    The material is stiffness, rest, stretch and shape of `arrays.Rod`.  The parts of the moments (6) that are
    viscous are in `viscous` (N, 4), and 1 + r pace of (7) is `rise`.
    """
    gradient[: 4 * nodes] = 0.0
    if second:
        hessian[:] = 0.0
    stiffness, rest, stretch, shape = material
    bend_1, bend_2, turn = stiffness[0] / rest, stiffness[1] / rest, stiffness[2] / rest
    # (7) the stiffness against a change of strain
    stiff_1, stiff_2, stiff_t = bend_1 * rise, bend_2 * rise, turn * rise
    stretching = bending = twisting = 0.0

    te, ie = triple(tangent, 0), inverse[0]
    m1e = triple(m1, 0)
    m2e = cross(te, m1e)
    for i in range(1, nodes - 1):
        tf, i_f = triple(tangent, i), inverse[i]
        m1f = triple(m1, i)
        m2f = cross(tf, m1f)
        # (1) curvatures
        chi = 1.0 + dot(te, tf)
        ix = 1.0 / chi
        kb = scaled(2.0 * ix, cross(te, tf))
        tt = mix(te, ix, tf, ix)
        n1 = mix(m1e, ix, m1f, ix)
        n2 = mix(m2e, ix, m2f, ix)
        kappa_1 = 0.5 * chi * dot(kb, n1)
        kappa_2 = 0.5 * chi * dot(kb, n2)
        # (2) moments of the strains, and their energy
        bent, wound = kappa_2 - shape[i, 0], twist[i] - shape[i, 1]
        a1, a2, at = bend_1 * kappa_1, bend_2 * bent, turn * wound
        bending += 0.5 * (a1 * kappa_1 + a2 * bent)
        twisting += 0.5 * at * wound
        # (6)
        a1, a2, at = a1 + viscous[i, 0], a2 + viscous[i, 1], at + viscous[i, 2]
        # (3), (4) first derivatives
        p1, p2 = cross(tf, n1), cross(tf, n2)
        q1, q2 = cross(te, n1), cross(te, n2)
        g1e, g2e = scaled(ie, mix(p1, 1.0, tt, -kappa_1)), scaled(ie, mix(p2, 1.0, tt, -kappa_2))
        g1f, g2f = scaled(-i_f, mix(q1, 1.0, tt, kappa_1)), scaled(-i_f, mix(q2, 1.0, tt, kappa_2))
        k1e, k2e = 0.5 * dot(kb, m2e), -0.5 * dot(kb, m1e)
        k1f, k2f = 0.5 * dot(kb, m2f), -0.5 * dot(kb, m1f)

        b = 4 * (i - 1)
        # (5) forces
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
            force = stretch[i] / rest * strain + viscous[i, 3]
            stretching += 0.5 * stretch[i] * strain * strain
            for c in range(3):
                gradient[b + 4 + c] -= force * tf[c]
                gradient[b + 8 + c] += force * tf[c]
            across = force * i_f
            along = stretch[i] / (rest * rest) * rise - across

        if second:
            # (7): of the edges e, f with themselves and with each other
            de_ = mix(m1e, a1, m2e, a2)
            df_ = mix(m1f, a1, m2f, a2)
            c = a1 * kappa_1 + a2 * kappa_2
            cx = c * ix
            u = mix(tt, c, mix(p1, a1, p2, a2), -1.0)
            w = mix(tt, c, mix(q1, a1, q2, a2), 1.0)
            ve = mix(mix(de_, 0.25, kb, 0.125 * stiff_t), 1.0, mix(te, 1.0, tt, 1.0), -0.25 * at)
            vf = mix(mix(df_, 0.25, kb, 0.125 * stiff_t), 1.0, mix(tf, 1.0, tt, 1.0), -0.25 * at)
            # skew part of the mixed block: [z]x
            z = mix(mix(de_, ix, df_, ix), -1.0, tt, 0.5 * at)
            kv = mix(kb, 0.25 * stiff_t, tt, -0.25 * at)
            ee, ef, ff = ie * ie, ie * i_f, i_f * i_f
            b1e, b2e = scaled(stiff_1, g1e), scaled(stiff_2, g2e)
            b1f, b2f = scaled(stiff_1, g1f), scaled(stiff_2, g2f)
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
            # (7): of edges with angles, of angles with each other
            le = mix(m2e, a1, m1e, -a2)
            lf = mix(m2f, a1, m1f, -a2)
            he, hf = 0.5 * dot(kb, le), 0.5 * dot(kb, lf)
            fe, ff_ = cross(tf, le), cross(tf, lf)
            ge, gf = cross(te, le), cross(te, lf)
            for r in range(3):
                half = 0.5 * stiff_t * kb[r]
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
            hessian[b + 3, 0] += stiff_1 * k1e * k1e + stiff_2 * k2e * k2e + stiff_t - 0.5 * dot(kb, de_)
            hessian[b + 7, 0] += stiff_1 * k1f * k1f + stiff_2 * k2f * k2f + stiff_t - 0.5 * dot(kb, df_)
            hessian[b + 3, 4] += stiff_1 * k1e * k1f + stiff_2 * k2e * k2f - stiff_t
        te, ie, m1e, m2e = tf, i_f, m1f, m2f
    energies[0] = stretching
    energies[1] = bending
    energies[2] = twisting


@compiled(**OPTIONS)
def resist(rod, tangent, inverse, m1, twist, velocity, strains, viscous):
    """The viscous parts (N, 4) of the moments (6) at velocities (4 N,), and the strains (N, 4).

    Of a node kappa_1, kappa_2, tau, and that of the edge behind it.
    """
    stiffness, rest, stretch, retardation = rod.stiffness, rod.rest, rod.stretch, rod.retardation
    bend_1, bend_2, turn = stiffness[0] / rest, stiffness[1] / rest, stiffness[2] / rest
    te, ie = triple(tangent, 0), inverse[0]
    m1e = triple(m1, 0)
    m2e = cross(te, m1e)
    for i in range(1, tangent.shape[0]):
        tf, i_f = triple(tangent, i), inverse[i]
        m1f = triple(m1, i)
        m2f = cross(tf, m1f)
        # (1)
        ix = 1.0 / (1.0 + dot(te, tf))
        kb = scaled(2.0 * ix, cross(te, tf))
        tt = mix(te, ix, tf, ix)
        n1, n2 = mix(m1e, ix, m1f, ix), mix(m2e, ix, m2f, ix)
        kappa_1, kappa_2 = 0.5 * dot(kb, n1) / ix, 0.5 * dot(kb, n2) / ix
        b = 4 * (i - 1)
        ve = (
            ie * (velocity[b + 4] - velocity[b]),
            ie * (velocity[b + 5] - velocity[b + 1]),
            ie * (velocity[b + 6] - velocity[b + 2]),
        )
        vf = (
            i_f * (velocity[b + 8] - velocity[b + 4]),
            i_f * (velocity[b + 9] - velocity[b + 5]),
            i_f * (velocity[b + 10] - velocity[b + 6]),
        )
        we, wf = velocity[b + 3], velocity[b + 7]
        # (3) to (5), of the rates
        both = dot(tt, ve) + dot(tt, vf)
        rate_1 = dot(cross(tf, n1), ve) - dot(cross(te, n1), vf) - kappa_1 * both
        rate_2 = dot(cross(tf, n2), ve) - dot(cross(te, n2), vf) - kappa_2 * both
        rate_1 += 0.5 * (dot(kb, m2e) * we + dot(kb, m2f) * wf)
        rate_2 -= 0.5 * (dot(kb, m1e) * we + dot(kb, m1f) * wf)
        strains[i, 0], strains[i, 1], strains[i, 2] = kappa_1, kappa_2, twist[i]
        strains[i, 3] = 1.0 / (i_f * rest) - 1.0
        viscous[i, 0] = retardation * bend_1 * rate_1
        viscous[i, 1] = retardation * bend_2 * rate_2
        viscous[i, 2] = retardation * turn * (0.5 * (dot(kb, ve) + dot(kb, vf)) + wf - we)
        viscous[i, 3] = retardation * stretch[i] / rest * dot(tf, vf) / (i_f * rest)
        te, ie, m1e, m2e = tf, i_f, m1f, m2f


@compiled(**OPTIONS)
def hold_tension(hessian, tangent, force):
    """Add to a Hessian what forces (N - 1,) along the edges do when these turn, per length of an edge."""
    for i in range(tangent.shape[0]):
        for r in range(3):
            for s in range(3):
                share = force[i] * ((1.0 if r == s else 0.0) - tangent[i, r] * tangent[i, s])
                hessian[4 * i + s, 4 + r - s] -= share
                if r >= s:
                    hessian[4 * i + s, r - s] += share
                    hessian[4 * i + 4 + s, r - s] += share
