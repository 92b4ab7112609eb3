"""How late does it snap?  Delays measured in every model, against theory without a free parameter."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from scipy.interpolate import CubicSpline

import der
from compare.face.section import Drawing, Table
from compare.face.style import figure, plt
from compare.models import warm_up
from compare.sweep import Sweep
from ribbonfem import Scene, SolverError, elastica, kirchhoff, quasilinear
from ribbonfem.delay import NormalForm, predict
from ribbonfem.results import History

from .registry import Question

DAMPINGS = (1e-3, 1e-2, 1e-1, 1.0, 10.0, 100.0, 1e3)
BEAM = Scene(compression=0.40, shear=0.0, start="U+")
PATH_1 = Scene(compression=0.40, shear=0.37, start="U+S-")
PATH_2 = Scene(compression=0.40, shear=0.37, start="U+S+")


@dataclass(frozen=True)
class System:
    """A model on a scene: which instant is its snap, and with what policy it runs.

    `quantity` crosses zero well past the fold; levels near it would bias the exponents.
    """

    name: str
    scene: Scene
    quantity: str
    simulate: Callable[..., History]
    normal_forms: Callable[..., tuple[NormalForm, ...]]
    mesh: dict[str, Any]
    policy: dict[str, Any]


SYSTEMS = {
    system.name: system
    for system in (
        System(
            "quasi-linear beam",
            BEAM,
            "height",
            quasilinear.simulate,
            quasilinear.normal_forms,
            {"elements": 32},
            {"until": "snap", "tolerance": 1e-7},
        ),
        System(
            "elastica",
            BEAM,
            "height",
            elastica.simulate,
            elastica.normal_forms,
            {"elements": 16},
            {"until": "snap", "tolerance": 1e-7},
        ),
        *(
            System(
                name,
                scene,
                quantity,
                kirchhoff.simulate,
                kirchhoff.normal_forms,
                {"elements": 8, "extensible": True},
                {"configurations": False, "tolerance": 3e-6},
            )
            for name, scene, quantity in (
                ("elements planar", BEAM, "height"),
                ("elements Path 1", PATH_1, "height"),
                ("elements Path 2", PATH_2, "slope"),
            )
        ),
        *(
            System(
                name,
                scene,
                quantity,
                der.simulate,
                der.normal_forms,
                {"nodes": 51},
                {"configurations": False},
            )
            for name, scene, quantity in (
                ("DER planar", BEAM, "height"),
                ("DER Path 1", PATH_1, "height"),
                ("DER Path 2", PATH_2, "slope"),
            )
        ),
    )
}
GROUPS: dict[str, tuple[str, ...]] = {
    "beam": ("quasi-linear beam", "elastica", "DER planar", "elements planar"),
    "ribbon": ("DER Path 1", "elements Path 1", "DER Path 2", "elements Path 2"),
}
GROUPS["all"] = GROUPS["beam"] + GROUPS["ribbon"]


@dataclass(frozen=True)
class Cell:
    """One measured delay: rad and s; None where no snap was found."""

    system: str
    damping: float
    rate: float
    damping_ratio: float
    predicted: float
    measured: float | None
    seconds: float
    problem: str = ""


def rates_for(damping: float, decades: int, per_decade: int = 1) -> list[float]:
    """Rates over `decades` decades up to where a snap still comes within some 2 rad of the fold.

    The overdamped delay grows as (rate nu)^(2/3), so that the fastest rate falls with nu.
    """
    fastest = 10.0 / max(1.0, 10.0 ** round(np.log10(damping)) / 10.0) if damping > 1.0 else 10.0
    count = decades * per_decade + 1
    return [float(rate) for rate in fastest * np.logspace(-decades, 0.0, count)]


def measure(name: str, form: NormalForm, damping: float, rate: float) -> Cell:
    """Ramp a system through its fold and return by how much the snap is late."""
    system = SYSTEMS[name]
    delay = predict(form, rate, damping)
    seconds, problem = 0.0, ""
    # a stop soon after the snap: what rings after it is not looked at
    for room in (1.15, 2.0, 4.0):
        stop = form.angle + room * delay.angle
        scene = replace(system.scene, rate=rate, damping=damping, stop=stop)
        try:
            history = system.simulate(scene, **system.mesh, **system.policy)
        except SolverError as error:
            problem = str(error)
            break
        seconds += float(history.stats["seconds"])
        snap = history.crossing(system.quantity)
        if snap is not None:
            measured = snap[1] - form.angle
            return Cell(name, damping, rate, delay.damping, delay.angle, measured, seconds)
        if stop > form.angle + 3.0:
            break
    return Cell(name, damping, rate, delay.damping, delay.angle, None, seconds, problem or "no snap")


def _measure(arguments: tuple[str, NormalForm, float, float]) -> Cell:
    return measure(*arguments)


def slope_of(cells: list[Cell]) -> tuple[float, float, float] | None:
    """Exponent of the angle delay over the three slowest rates, with their range."""
    good = sorted((c for c in cells if c.measured), key=lambda c: c.rate)[:3]
    if len(good) < 2:
        return None
    x, y = np.log([c.rate for c in good]), np.log([c.measured for c in good if c.measured])
    return float(np.polyfit(x, y, 1)[0]), good[0].rate, good[-1].rate


def ratio_limit(cells: list[Cell]) -> float | None:
    """measured / predicted in the limit of a slow ramp, from the three slowest rates.

    What the normal form leaves out is the time of the snap itself, against that of its layer at the
    fold: rate^(1/5) where inertia rules and rate^(1/3) where damping does.
    """
    good = sorted((c for c in cells if c.measured), key=lambda c: c.rate)[:3]
    if len(good) < 3:
        return None
    power = 1.0 / 5.0 if good[0].damping_ratio < 1.0 else 1.0 / 3.0
    x = np.array([c.rate**power for c in good])
    y = np.array([(c.measured or 0.0) / c.predicted for c in good])
    return float(np.polynomial.Polynomial.fit(x, y, 2)(0.0))


def universal_curve(cells: Sequence[Cell], forms: dict[str, NormalForm]) -> CubicSpline:
    """ln f against ln Lambda through the values that the cells were predicted with.

    Each of them is an integration of the normal form; a figure needs hundreds.
    """
    found = {}
    for cell in cells:
        scale = (forms[cell.system].product * cell.rate) ** 0.2
        found[round(float(np.log(cell.damping_ratio)), 3)] = float(np.log(cell.predicted / cell.rate * scale))
    points = sorted(found.items())
    return CubicSpline(*np.array(points).T)


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
            colour = plt.cm.viridis(k / 6.5)
            group = sorted((c for c in mine if c.damping == damping), key=lambda c: c.rate)
            rates = np.logspace(np.log10(group[0].rate), np.log10(group[-1].rate), 40)
            tau = (form.product * rates) ** -0.2
            late = tau * np.exp(curve(np.log(damping * tau)))
            angle.loglog(rates, rates * late, color=colour, lw=0.9)
            time.loglog(rates, late, color=colour, lw=0.9)
            found = [(c.rate, c.measured) for c in group if c.measured]
            if found:
                x, y = np.array(found).T
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


@dataclass(frozen=True)
class Delays:
    """What was found: the systems' normal forms, and every measured delay."""

    forms: dict[str, NormalForm]
    dampings: tuple[float, ...]
    cells: tuple[Cell, ...]

    def of(self, name: str, damping: float) -> list[Cell]:
        """The delays of a system at a damping."""
        return [c for c in self.cells if c.system == name and c.damping == damping]


def _cost(work: tuple[str, NormalForm, float, float]) -> float:
    """Slow ramps at little damping take longest."""
    return 1.0 / (work[3] * max(work[2], 1e-2))


def main(
    *,
    systems: Literal["beam", "ribbon", "all"] = "all",
    dampings: tuple[float, ...] = DAMPINGS,
    decades: int = 5,
    sweep: Sweep | None = None,
) -> Delays:
    """Measure how late the snap comes, for every model, damping and rate (paper, Figs. 6 to 9).

    The delay of the angle past the static fold on the same mesh, against the prediction from the
    fold's normal form, which has no free parameter; exponents with their ranges.
    --systems: beam, ribbon or all.
    """
    sweep = sweep or Sweep()
    if systems not in GROUPS:
        raise ValueError(f"systems = {systems!r}: must be one of {', '.join(GROUPS)}")
    names = GROUPS[systems]
    forms = {}
    for name in sweep.progress("static folds", names):
        system = SYSTEMS[name]
        forms[name] = system.normal_forms(system.scene, **system.mesh)[0]
    work = [
        (name, forms[name], damping, rate)
        for name in names
        for damping in dampings
        for rate in rates_for(damping, decades)
    ]
    work.sort(key=_cost, reverse=True)
    cells = sweep("delays", _measure, work, cost=_cost, prepare=warm_up)
    return Delays(forms, tuple(dampings), tuple(cells))


def _exponents(found: Delays) -> Iterator[tuple[str, float, tuple[float, float, float], Cell, float, Any]]:
    """System, damping, fitted exponent and its range, the slowest cell, the predicted exponent, the limit."""
    for name in found.forms:
        for damping in found.dampings:
            mine = found.of(name, damping)
            fitted = slope_of(mine)
            slow = min((c for c in mine if c.measured), key=lambda c: c.rate, default=None)
            if fitted is None or slow is None or slow.measured is None:
                continue
            ends = sorted((c for c in mine if c.rate in fitted[1:]), key=lambda c: c.rate)
            theory = float(np.log(ends[1].predicted / ends[0].predicted) / np.log(fitted[2] / fitted[1]))
            yield name, damping, fitted, slow, theory, ratio_limit(mine)


def words(found: Delays) -> list[str]:
    """The theory, its one number of each system, and how to judge it."""
    return [
        "At a fold every model has the normal form A'' + nu A' = c (alpha - alpha_c) + a2 A^2. Its "
        "product c a2 comes from statics alone, and with it the delay at any rate and damping: "
        "T_s = (c a2 rate)^(-1/5) f(Lambda), Lambda = nu (c a2 rate)^(-1/5).",
        "c a2 in s^-4/rad: "
        + ", ".join(f"{name} {form.product:.5g}" for name, form in found.forms.items())
        + ".",
        "Exponents of the angle delay tend to 4/5 where inertia rules and to 2/3 where damping does, of "
        "the time delay to -1/5 and -1/3, but slowly: judge by measured / predicted at the slowest rate "
        "and its limit.",
    ]


def tables(found: Delays) -> list[Table]:
    """Exponents and limits, then every cell."""
    exponents = [
        [name, damping, f"{fitted[1]:.0e} .. {fitted[2]:.0e}", slow.damping_ratio]
        + [fitted[0], theory, fitted[0] - 1.0, (slow.measured or 0.0) / slow.predicted, limit]
        for name, damping, fitted, slow, theory, limit in _exponents(found)
    ]
    names = list(found.forms)
    rows = [
        [c.system, c.damping, c.rate, c.damping_ratio, c.measured, c.predicted]
        + [None if c.measured is None else c.measured / c.predicted, c.seconds, c.problem]
        for c in sorted(found.cells, key=lambda c: (names.index(c.system), c.damping, c.rate))
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
            + ["ratio", "s", "problem"],
            rows,
            ["s", "g", ".0e", ".2e", ".4e", ".4e", ".4f", ".2f", "s"],
        ),
    ]


def drawings(found: Delays) -> Iterator[Drawing]:
    """The paper's Figs. 6 to 9."""
    for group, title in (
        ("beam", "The beam (paper, Figs. 6 and 7)"),
        ("ribbon", "The ribbon (paper, Figs. 8 and 9)"),
    ):
        if set(GROUPS[group]) <= set(found.forms):
            yield Drawing(
                f"delay-{group}.png",
                f"{title}: measured delays (circles) and the prediction from the static fold (lines).",
                _draw(found.cells, found.forms, GROUPS[group]),
            )


def values(found: Delays) -> dict[str, Any]:
    """The numbers for programs."""
    return {
        "products": {name: form.product for name, form in found.forms.items()},
        "folds": {name: form.angle for name, form in found.forms.items()},
        "exponents": [
            {
                "system": name,
                "damping": damping,
                "exponent": fitted[0],
                "rates": fitted[1:],
                "limit": limit,
            }
            for name, damping, fitted, _, _, limit in _exponents(found)
        ],
        "cells": [vars(c) for c in found.cells],
    }


QUESTION = Question(
    name="delay",
    title="The delay of the snap, and theory without a free parameter",
    takes="some 15 minutes",
    main=main,
    words=words,
    tables=tables,
    drawings=drawings,
    values=values,
)
