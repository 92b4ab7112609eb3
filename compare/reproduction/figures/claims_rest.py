"""The paper's claims of the ribbon at rest, each with its test and verdict."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compare.limits import edge_ratio, of_folds
from compare.quantities.branches import stable_at
from compare.quantities.planar_curves import DRAWN
from compare.reproduction.paths import Swept
from ribbonfem import Ribbon
from ribbonfem.results import Array, RestState

from .at_rest import NODES, Phases, Planar, PlanarFold, Ribbons, States
from .verdict import NO, OPEN, Claim, Verdict, judged, percent

# the paper's numbers, and half a unit of their last digit
PAPER_FOLD = (7.5864, 1.7818, 0.3476)
_ROUNDED = 5.001e-5


def _closed_form(planar: Planar) -> Verdict:
    sigma, mu, height = planar.closed
    near = all(abs(abs(a) - b) < _ROUNDED for a, b in zip((sigma, mu, height), PAPER_FOLD, strict=True))
    off = planar.beam[0] / sigma - 1.0
    # with alpha > 0 turning the tangent down, both have one sign at the fold met from U+
    same = (
        ""
        if mu * height < 0.0
        else (
            "signs: with the angle of the paper's 3D model, as here, mu and Z have the same sign; its "
            "planar model counts the angle the other way"
        )
    )
    return judged(
        near and abs(off) < 1e-5,
        f"sigma {sigma:.6f}, mu {mu:.6f}, Z {height:+.6f}",
        f"sigma of 64 elements off by {off:.0e}",
        same,
    )


def _single(planar: Planar) -> Verdict:
    counts = [fold.count for fold in planar.folds]
    return judged(
        set(counts) == {1},
        f"{counts.count(1)} of {len(counts)} end-shortenings have one fold",
        "none: a count",
    )


def _drawn(planar: Planar) -> tuple[tuple[float, float, float], list[PlanarFold]]:
    return planar.closed, [fold for fold in planar.folds if fold.compression in DRAWN]


def _uncertainty(folds: list[PlanarFold]) -> str:
    """How far rods and elements with EA are apart in mu."""
    return f"rods and elements agree to {max(abs(f.rods[1] - f.stretched[1]) for f in folds):.0e} in mu"


def _collapse(planar: Planar) -> Verdict:
    closed, folds = _drawn(planar)
    mu, height = (max(abs(fold.plain[k] / closed[k] - 1.0) for fold in folds) for k in (1, 2))
    correction = (
        ""
        if height < 0.03
        else (f"the angles of the folds collapse, the heights do not: Z is up to {100 * height:.0f} % off")
    )
    return judged(
        mu < 0.01,
        f"mu within {100 * mu:.2f} %, Z within {100 * height:.1f} %",
        _uncertainty(folds),
        correction,
    )


def _small_slopes(planar: Planar) -> Verdict:
    closed, folds = planar.closed, sorted(planar.folds, key=lambda fold: fold.compression)
    off = np.array([[fold.plain[k] / closed[k] - 1.0 for k in range(3)] for fold in folds])
    falling = [bool(np.all(np.diff(np.abs(off[:, k])) > 0.0)) for k in range(3)]
    tends = bool(np.all(np.abs(off[0]) < 0.02))
    parts = []
    if not falling[1]:
        least = folds[int(np.argmin(np.abs(off[:, 1])))].compression
        parts.append(
            f"true of sigma and Z; the error of mu changes its sign and is least near dL/L = {least:.2f}"
        )
    stretch = folds[0].stretched[1] / closed[1] - 1.0
    if abs(stretch) > 3.0 * abs(off[0, 1]):
        parts.append(
            f"with the stretch of h/L = 0.01, which the discrete model has, mu is {percent(stretch)} off "
            f"at dL/L = {folds[0].compression:g}, and does not tend to the closed form"
        )
    correction = "; ".join(parts)
    said = ", ".join(
        f"{percent(value)} at {fold.compression:g}" for value, fold in zip(off[:, 1], folds, strict=True)
    )
    return judged(falling[0] and falling[2] and tends, f"mu: {said}", _uncertainty(folds), correction)


def _off_limit(swept: Swept) -> list[float]:
    """Rods in their limit minus elements with EA, of each fold, rad."""
    ratio = edge_ratio(*NODES)
    pairs = zip(swept.coarse, swept.fine, swept.stretched, strict=True)
    return [of_folds(a, b, ratio).angle - c.angle for a, b, c in pairs]


def _count(ribbons: Ribbons, path: str, count: int, correction: str) -> Verdict:
    its: Swept = getattr(ribbons, path)
    text = ", ".join(f"{fold.angle:.7f}" for fold in its.plain)
    off = _off_limit(its)
    uncertainty = f"off by {off[0]:+.0e}" if count == 1 else f"within {max(map(abs, off)):.0e}"
    return judged(
        len(its.plain) == len(its.fine) == count,
        f"{len(its.plain)} fold{'' if count == 1 else 's'}, at {text} rad",
        f"rods' limit {uncertainty} rad (with EA)",
        correction,
    )


def _same_fold(ribbons: Ribbons) -> Verdict:
    one, two = ribbons.path_1, ribbons.path_2
    if len(two.plain) < 2 or not one.plain:
        return Verdict(NO, "no second fold")
    off = two.plain[-1].angle - one.plain[-1].angle
    return judged(abs(off) < 1e-7, f"{two.plain[-1].angle:.9f} rad on both", f"differ by {off:.0e} rad")


def _agree(ribbons: Ribbons) -> Verdict:
    off = [abs(value) for path in (ribbons.path_1, ribbons.path_2) for value in _off_limit(path)]
    clamped = [a / b.angle - 1.0 for a, b in zip(ribbons.two_node, ribbons.path_2.stretched, strict=True)]
    worst = max(clamped, key=abs)
    correction = (
        ""
        if abs(worst) < 0.01
        else (
            f"with the paper's clamp, both end edges held, rods of {NODES[1]} nodes put a fold "
            f"{percent(worst)} off: an error of first order in 1/N; edges centred on the ends leave one of "
            "second"
        )
    )
    return judged(
        max(off) < 1e-5,
        f"rods in their limit within {max(off):.0e} rad",
        f"of rods of {NODES[0]} and {NODES[1]} nodes, extrapolated",
        correction,
    )


def _both_stable(ribbons: Ribbons) -> Verdict:
    two = ribbons.path_2
    if len(two.plain) < 2:
        return Verdict(NO, "no second fold")
    middle = 0.5 * (two.plain[0].angle + two.plain[1].angle)
    # U-S+ at alpha is the mirror image of U+S+ at -alpha
    heights = [height for height, _ in stable_at(ribbons.paths.curve, middle)]
    return judged(
        any(z > 0.0 for z in heights) and any(z < 0.0 for z in heights),
        f"at {middle:.3f} rad stable at z(1/2)/L = "
        + ", ".join(f"{z:+.3f}" for z in sorted(heights, reverse=True)),
        "none: counted on the curve",
    )


def _right_clamp(ribbons: Ribbons) -> Verdict:
    seen = {turned.start: turned for turned in ribbons.turned}
    right = seen["U+S+"].shapes == ("U+S+", "U-S-") and seen["U+S-"].shapes == ("U+S-", "U+S+", "U-S-")
    correction = "section 2 gives these paths to the left end: they are the right end's, as section 5 says"
    said = "; ".join(" to ".join(turned.shapes) for turned in ribbons.turned)
    return judged(right, said, "none: names of shapes", correction)


def _dependence(swept: dict[str, tuple[Swept, ...]]) -> Verdict:
    parts, right = [], True
    for name, results in swept.items():
        right &= all(len(its.plain) == len(its.fine) == 2 for its in results)
        for k in range(2):
            angles = [its.plain[k].angle for its in results if len(its.plain) > k]
            steps = np.diff(angles)
            way = "rises" if np.all(steps > 0.0) else "falls" if np.all(steps < 0.0) else "turns"
            parts.append(f"alpha_c{k + 1} {way} with {name}, {angles[0]:.4f} to {angles[-1]:.4f}")
    off = max(abs(value) for results in swept.values() for its in results for value in _off_limit(its))
    return judged(
        right and off < 1e-4, "; ".join(parts) + " rad", f"rods' limit within {off:.0e} rad (with EA)"
    )


def _four_states(states: States) -> Verdict:
    ours, theirs = states.stable
    four = ("U+S+", "U+S-", "U-S+", "U-S-")
    return judged(ours == theirs == four, ", ".join(ours) + " in both models", "none: a count")


def _along(states: Sequence[RestState], name: str, quantity: str, s: Array) -> Array:
    """A curvature or the twist of a state at arclengths s."""
    state = next(state for state in states if state.name == name)
    order = np.argsort(state.points)
    return np.asarray(np.interp(s, state.points[order], getattr(state, quantity)[order]))


def _symmetry(states: States) -> Verdict:
    worst, same = 0.0, 0.0
    grid = np.linspace(0.03, 0.97, 200)
    for its in (states.elements, states.rods):
        for quantity in ("kappa2", "tau"):
            whole = _along(its, "U+S+", quantity, grid)
            off = (
                whole + _along(its, "U-S+", quantity, grid),
                whole - _along(its, "U+S-", quantity, 1.0 - grid),
            )
            worst = max(worst, float(np.abs(off).max() / np.abs(whole).max()))
        one = _along(its, "U+S+", "kappa1", grid)
        same = max(same, float(np.abs(one - _along(its, "U-S+", "kappa1", grid)).max() / np.abs(one).max()))
    correction = "of the mirror image kappa2 and the twist change sign; kappa1, about the normal, does not"
    correction = correction if same < 0.5 else ""
    return judged(
        worst < 0.02,
        f"kappa2 and twist: mirror and reversal hold to {worst:.0e} of the largest",
        "largest deviation of both models, with interpolation",
        correction,
    )


def _phases(phases: Phases) -> Verdict:
    grid = phases.grid
    names = {str(record["kirchhoff"]) for record in grid}
    agree = sum(record["kirchhoff"] == record["der"] for record in grid)
    correction = (
        ""
        if "S, U" not in names
        else ("a fourth region: at large shear the unbroken U is stable again, beside S")
    )
    return judged(
        {"U", "US", "S"} <= names,
        f"{', '.join(sorted(names - {'S, U'}))} found",
        f"elements and rods agree in {agree} of {len(grid)} scenes",
        correction,
    )


def _supercritical(phases: Phases) -> Verdict:
    gaps = []
    for its in phases.heights:
        stable = {family: np.asarray(x)[np.asarray(ok)] for family, x, _, ok in its.lines}
        us = next(np.asarray(x) for family, x, _, _ in its.lines if family == "US")
        start = float(us.min())
        # the last shear at which the unbroken U is stable, before it is so again
        before = float(stable["U"][stable["U"] < start + 0.05].max())
        gaps.append(start - before)
    worst = max(gaps, key=abs)
    return judged(
        abs(worst) < 0.01,
        f"US begins {worst:+.0e} L from where U loses its stability",
        f"largest of {len(gaps)} compressions; points of the curve are as far apart",
    )


def _s_to_s(phases: Phases) -> Verdict:
    return Verdict(
        OPEN,
        "no run here turns S+ into S-",
        "",
        "both are stable side by side; what a stretch of the centreline would allow was not asked",
    )


def _ratios(width: tuple[float, float]) -> Verdict:
    paper, ours = Ribbon(width=0.1), Ribbon()
    moved = width[1] / width[0] - 1.0
    correction = (
        f"W = 0.1 and h = 0.01 give EI1/EI2 = {paper.bending_ratio:g}; 400 and {ours.twist_ratio:.4f} are "
        f"those of W = {ours.width:g} and Poisson's ratio {ours.poisson:.2f}. In motion W enters the "
        "rotary inertia"
    )
    return judged(
        abs(ours.bending_ratio - 400.0) < 1e-9 and abs(ours.twist_ratio - 1.4562) < 5e-5,
        f"W halved, ratios kept: the snap of Path 1 at 1 rad/s, nu = 1, moves by {percent(moved)}",
        "of one mesh, 8 elements",
        correction,
    )


CLAIMS = (
    Claim("fig3", "section 4.3", "The small-slope beam folds at sigma = 7.5864, mu = +-1.7818, Z = -+0.3476.",
          _closed_form),
    Claim("fig3", "section 5.1, Fig. 3B", "A planar beam turned at one end snaps at one fold.", _single),
    Claim("fig3", "section 5.1, Fig. 3C", "Rescaled by the root of dL/L, all compressions fall on one curve.",
          _collapse),
    Claim("fig3", "section 5.1", "The error of small slopes falls with the compression.", _small_slopes),
    Claim("fig4", "section 5.2, Fig. 4A", "Path 1, U+S- to U-S+, has one fold.", _count,
          ("path_1", 1, "the caption of Fig. 4 starts this path at U+S+: text and section 2 have U+S-, "
           "as here")),
    Claim("fig4", "section 5.2, Fig. 4B", "Path 2, U+S+ to U+S- to U-S+, has two folds.", _count,
          ("path_2", 2, "the caption of Fig. 4 has S+ and S- exchanged")),
    Claim("fig4", "section 5.2", "The second snap of Path 2 is that of Path 1.", _same_fold),
    Claim("fig4", "section 5.2, Fig. 4", "Theory and discrete rods agree.", _agree),
    Claim("fig4", "section 7.2", "Between the two folds both U+S- and U-S+ are stable.", _both_stable),
    Claim("fig4", "sections 2 and 5.2", "The right end turned: U+S+ to U-S- at once, U+S- by U+S+.",
          _right_clamp),
    Claim("fig5", "section 5.2, Fig. 5", "Both folds depend on compression and shear; theory and rods agree.",
          _dependence),
    Claim("fig15", "appendix A", "At (0.40, 0.37) there are four stable states.", _four_states),
    Claim("fig15", "appendix A, Fig. 15", "Curvatures change sign from U+ to U-, are reversed S+ to S-.",
          _symmetry),
    Claim("fig16", "appendix B, Fig. 16", "Compression and shear give three phases: U, US and S.", _phases),
    Claim("fig16", "section 2", "US comes from U by a supercritical pitchfork.", _supercritical),
    Claim("fig16", "appendix B", "S+ and S- cannot snap into each other: the centreline does not stretch.",
          _s_to_s),
    Claim("fig8", "section 5", "W = 0.1, EI1/EI2 = 400, GJ/EI2 = 1.4562; the width does not matter.",
          _ratios),
)  # fmt: skip
