"""The command `delay`: delays of snaps measured in every model, against theory with no parameter fitted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Literal

import numpy as np

from compare.report.registry import Command
from compare.report.section import Drawing, Table
from compare.reproduction.delays import (
    DAMPINGS,
    GROUPS,
    Cell,
    Delays,
    compute,
    ratio_limit,
    slope_of,
    universal_curve,
)
from compare.sweep import Sweep
from ribbonfem.delay import NormalForm
from ribbonfem.output.style import colormaps, figure


def _draw(cells: Sequence[Cell], forms: dict[str, NormalForm], names: tuple[str, ...]) -> Any:
    """The paper's three panels for each system, the predicted curves drawn through the points."""
    curve = universal_curve(cells, forms)
    fig, axes = figure(3, len(names), width=4.0, height=3.1)
    axes = np.atleast_2d(axes)
    for row, name in enumerate(names):
        angle, time, collapse = axes[row]
        form = forms[name]
        mine = [c for c in cells if c.system == name]
        for k, damping in enumerate(sorted({c.damping for c in mine})):
            colour = colormaps["viridis"](k / 6.5)
            group = sorted((c for c in mine if c.damping == damping), key=lambda c: c.rate)
            rates = np.logspace(np.log10(group[0].rate), np.log10(group[-1].rate), 40)
            tau = (form.product * rates) ** -0.2
            late = tau * np.exp(curve(np.log(damping * tau)))
            angle.loglog(rates, rates * late, color=colour, lw=0.9)
            time.loglog(rates, late, color=colour, lw=0.9)
            further = np.array([(c.rate, c.next_order) for c in group if c.next_order > 0.0]).T
            if further.size:
                angle.loglog(*further, "--", color=colour, lw=0.9)
                time.loglog(further[0], further[1] / further[0], "--", color=colour, lw=0.9)
            result = [(c.rate, c.measured) for c in group if c.measured]
            if result:
                x, y = np.array(result).T
                angle.loglog(x, y, "o", ms=3.5, mfc="none", color=colour, label=f"$\\nu$ = {damping:g}")
                time.loglog(x, y / x, "o", ms=3.5, mfc="none", color=colour)
                scale = (form.product * x) ** 0.2
                collapse.loglog(damping / scale, y / x * scale, "o", ms=3.5, mfc="none", color=colour)
        ends = [c.damping_ratio for c in mine]
        span = np.logspace(np.log10(min(ends)), np.log10(max(ends)), 80)
        collapse.loglog(span, np.exp(curve(np.log(span))), "k-", lw=0.9, label="$f(\\Lambda)$")
        collapse.loglog(span, 2.33811 * span ** (2 / 3), "k:", lw=0.7, label=r"$2.338\,\Lambda^{2/3}$")
        collapse.set_ylim(1.0, 2e3)
        angle.set(
            title=f"{name}: angle delay", ylabel=r"$\Delta\alpha$ (rad)", xlabel=r"$\dot\alpha$ (rad/s)"
        )
        time.set(title="time delay", ylabel="$T_s$ (s)", xlabel=r"$\dot\alpha$ (rad/s)")
        collapse.set(title="collapse", ylabel=r"$T_s\,(c\,a_2\,\dot\alpha)^{1/5}$", xlabel=r"$\Lambda$")
        if row == 0:
            angle.legend(fontsize=6.5)
        collapse.legend(fontsize=6.5)
    return fig


def main(
    *,
    systems: Literal["beam", "ribbon", "all"] = "all",
    dampings: tuple[float, ...] = DAMPINGS,
    decades: int = 5,
    sweep: Sweep | None = None,
) -> Delays:
    """Measure how late the snap comes, for every model, damping and rate (paper, Figs. 6 to 9).

    The delay is the angle between the snap and the static fold of the same mesh. It is compared with the
    prediction from the fold's normal form, which has no free parameter. Exponents of the rate are given
    with the range of rates over which they were fitted. --systems: beam, ribbon or all. --decades: how many
    decades of the rate.
    """
    sweep = sweep or Sweep()
    if systems not in GROUPS:
        raise ValueError(f"systems = {systems!r}: must be one of {', '.join(GROUPS)}")
    names = GROUPS[systems]
    return compute(names, tuple(dampings), decades, sweep)


def _exponents(result: Delays) -> Iterator[tuple[str, float, tuple[float, float, float], Cell, float, Any]]:
    """System, damping, fitted exponent and its range, the slowest cell, the predicted exponent, the limit."""
    for name in result.forms:
        for damping in result.dampings:
            mine = result.of(name, damping)
            fitted = slope_of(mine)
            slow = min((c for c in mine if c.measured), key=lambda c: c.rate, default=None)
            if fitted is None or slow is None or slow.measured is None:
                continue
            ends = sorted((c for c in mine if c.rate in fitted[1:]), key=lambda c: c.rate)
            theory = float(np.log(ends[1].predicted / ends[0].predicted) / np.log(fitted[2] / fitted[1]))
            yield name, damping, fitted, slow, theory, ratio_limit(mine)


def summary(result: Delays) -> list[str]:
    """The theory, its one number of each system, and how to judge it."""
    return [
        "At a fold every model has the normal form A'' + nu A' = c (alpha - alpha_c) + a2 A^2. Its "
        "product c a2 comes from statics alone, and with it the delay at any rate and damping: "
        "T_s = (c a2 rate)^(-1/5) f(Lambda), Lambda = nu (c a2 rate)^(-1/5). To the next order the cubic "
        "term counts, and the time T0 by which the snap precedes the end of the normal form on the one "
        "trajectory that leaves the fold by itself.",
        "c a2 in s^-4/rad: "
        + ", ".join(f"{name} {form.product:.5g}" for name, form in result.forms.items())
        + ".",
        "Exponents of the angle delay tend to 4/5 where inertia rules and to 2/3 where damping does, of "
        "the time delay to -1/5 and -1/3, but slowly: judge by measured / predicted at the slowest rate "
        "and its limit.",
    ]


def tables(result: Delays) -> list[Table]:
    """Exponents and limits, then every cell."""
    exponents = [
        [name, damping, f"{fitted[1]:.0e} .. {fitted[2]:.0e}", slow.damping_ratio]
        + [fitted[0], theory, fitted[0] - 1.0, (slow.measured or 0.0) / slow.predicted, limit]
        for name, damping, fitted, slow, theory, limit in _exponents(result)
    ]
    names = list(result.forms)
    rows = [
        [c.system, c.damping, c.rate, c.damping_ratio, c.measured, c.predicted, c.next_order, c.error]
        + [None if c.measured is None else c.measured / of for of in (c.predicted, c.next_order)]
        + [c.seconds, c.problem]
        for c in sorted(result.cells, key=lambda c: (names.index(c.system), c.damping, c.rate))
    ]
    return [
        Table(
            "Exponents over the three slowest rates, and the limit of measured / predicted",
            ["system", "nu (1/s)", "rates (rad/s)", "Lambda", "exponent", "predicted", "of the time"]
            + ["ratio, slowest", "ratio, limit"],
            exponents,
            ["s", "g", "s", ".2e", ".4f", ".4f", "+.4f", ".4f", ".4f"],
            "Lambda at the slowest rate. predicted: exponent of the predicted curve over the same rates. "
            "of the time: exponent of the time delay. limit: quadratic extrapolation to rate 0.",
        ),
        Table(
            "All cells",
            ["system", "nu (1/s)", "rate (rad/s)", "Lambda", "measured (rad)", "predicted (rad)"]
            + ["to the next order", "its error", "ratio", "ratio, next order", "s", "problem"],
            rows,
            ["s", "g", ".0e", ".2e", ".4e", ".4e", ".4e", ".0e", ".4f", ".4f", ".2f", "s"],
        ),
        Table(
            "T0: by how much the snap precedes the end of the fold's normal form",
            ["system", "nu (1/s)", "T0 (s)", "uncertainty (s)"],
            [[e.system, e.damping, e.lead.time, e.lead.error] for e in result.escapes],
            ["s", "g", ".5f", ".0e"],
            "Of one escape from the fold, the clamp held. Uncertainty: of its extrapolation to no push.",
        ),
    ]


def drawings(result: Delays) -> Iterator[Drawing]:
    """The paper's Figs. 6 to 9."""
    for group, title in (
        ("beam", "The beam (paper, Figs. 6 and 7)"),
        ("ribbon", "The ribbon (paper, Figs. 8 and 9)"),
    ):
        if set(GROUPS[group]) <= set(result.forms):
            yield Drawing(
                f"delay-{group}.png",
                f"{title}: measured delays (circles), the prediction from the static fold (lines), "
                "and the one to the next order (dashed).",
                _draw(result.cells, result.forms, GROUPS[group]),
            )


def values(result: Delays) -> dict[str, Any]:
    """The numbers for programs."""
    return {
        "products": {name: form.product for name, form in result.forms.items()},
        "folds": {name: form.angle for name, form in result.forms.items()},
        "exponents": [
            {
                "system": name,
                "damping": damping,
                "exponent": fitted[0],
                "rates": fitted[1:],
                "limit": limit,
            }
            for name, damping, fitted, _, _, limit in _exponents(result)
        ],
        "cells": [vars(c) for c in result.cells],
        "leads": [
            {"system": e.system, "damping": e.damping, "T0": e.lead.time, "error": e.lead.error}
            for e in result.escapes
        ],
    }


COMMAND = Command(
    name="delay",
    title="The delay of the snap, and theory without a free parameter",
    takes="some 15 minutes",
    main=main,
    summary=summary,
    tables=tables,
    drawings=drawings,
    values=values,
    keep=True,
)
