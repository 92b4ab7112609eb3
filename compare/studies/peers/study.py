"""The command `peers`: CPU time at equal error of this package and of other programs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

import numpy as np

import der
from compare.external import auto as peer_auto
from compare.external import exudyn as peer_exudyn
from compare.external import pyelastica as peer_pyelastica
from compare.report.registry import Command
from compare.report.section import Column, Drawing, Table
from compare.studies.study import here
from compare.sweep import Sweep
from ribbonfem import elastica, kirchhoff
from ribbonfem.options import whole_number
from ribbonfem.output.style import figure
from ribbonfem.results import Array

from . import attempts
from .attempts import (
    BRANCH,
    ERROR,
    PLANAR,
    RIBBON,
    Attempt,
    Timing,
    alternate,
    attempted,
    branch_runs,
    cheapest,
    elastica_runs,
    exudyn_planar_runs,
    exudyn_ribbon_runs,
    kirchhoff_runs,
    pyelastica_runs,
    rod_runs,
    settled,
)

# of the elements in three dimensions: mesh and tolerance
_ELEMENTS = ((8, None), (4, 1e-3), (4, 3e-4), (4, 1e-4), (6, 1e-4), (6, 3e-5), (8, 1e-5), (12, 1e-6))
DEFAULTS = "The elastica with its defaults"


def _draw(runs: Sequence[Timing]) -> Any:
    """|Error| of the snap angle against CPU seconds, a colour a code."""
    fig, axes = figure(1, width=6.2, height=4.2)
    for marker, code in zip("osD^vP", dict.fromkeys(run.code for run in runs), strict=False):
        chosen = [run for run in runs if run.code == code and run.done]
        seconds = [run.seconds for run in chosen]
        axes.loglog(seconds, [abs(run.error or 0.0) for run in chosen], marker, ms=5, alpha=0.8, label=code)
    axes.axhline(ERROR, color="0.6", lw=0.8, ls=":")
    axes.set(xlabel="CPU seconds", ylabel="error of the snap angle (rad)")
    axes.legend(fontsize=8)
    return fig


def _ratios(chosen: dict[str, Timing], taken: Array) -> list[str]:
    """Sentences on the ratios at equal error, from the CPU seconds (rounds, chosen)."""
    (_, base), *others = chosen.items()
    sentences = [
        f"Planar snap at an error of at most {ERROR:g} rad, CPU seconds in those of the extensible elastica "
        f"({base.resolution}, {base.step}: {base.seconds:.3f} s):"
    ]
    for what, run in others:
        if run.ratio is not None and run.error is not None:
            low, middle, high = run.ratio
            sentences.append(
                f"{what} ({run.resolution}, {run.step}, error {abs(run.error):.0e}): {middle:.1f} times "
                f"({low:.1f} to {high:.1f})."
            )
    names = list(chosen)
    for what in names:
        if "Exudyn" in what and DEFAULTS in names:
            ratio = taken[:, names.index(what)] / taken[:, names.index(DEFAULTS)]
            sentences.append(
                f"{what}: {np.median(ratio):.1f} times ({ratio.min():.1f} to {ratio.max():.1f}) what the "
                "extensible elastica takes with its defaults."
            )
    return sentences


def _ratio(which: int, run: Timing) -> float | None:
    return None if run.ratio is None else run.ratio[which]


_COLUMNS: list[Column] = [
    *(("code", "s", "code"), ("resolution", "s", "resolution"), ("step", "s", "step")),
    *(("error", ".1e", "error"), ("CPU s", ".3f", "seconds")),
    *((name, ".2f", partial(_ratio, k)) for k, name in enumerate(("ratio, min", "median", "max"))),
    ("note", "s", "note"),
]


@dataclass(frozen=True)
class Peers:
    """What was found.

    Attributes
    ----------
    truth, turned: limits of the planar and of the ribbon's snap, rad.
    rounds: of runs by turns.
    planar, ribbon, branch: what every code did.
    shown: which of the planar ones stand in the table (Exudyn's grid in full is for the picture).
    chosen: those that ran by turns, by what they are.
    taken: (rounds, chosen) their CPU seconds.
    lacking: which programs are missing.
    """

    truth: float
    turned: float
    rounds: int
    planar: tuple[Timing, ...]
    ribbon: tuple[Timing, ...]
    branch: tuple[Timing, ...]
    shown: tuple[int, ...]
    chosen: dict[str, Timing]
    taken: Array
    lacking: tuple[str, ...]


def _planar(truth: float, rounds: int, explicit: bool, sweep: Sweep) -> dict[str, Any]:
    """The planar snap in every code: `Peers`'s planar, shown, chosen and taken."""
    own, rods = elastica_runs(truth, True, (*_ELEMENTS, (24, 1e-7))), rod_runs(PLANAR, truth)
    ribbon = kirchhoff_runs(PLANAR, truth, _ELEMENTS)
    stiff = elastica_runs(attempts.planar_truth(False), False, ((8, None), (6, 3e-5)))
    exudyn = [] if peer_exudyn.missing() else exudyn_planar_runs(truth)
    # the last is past its step limit, and says nothing
    verlet = pyelastica_runs(PLANAR, truth, ((25, 2.5e-5), (51, 2.5e-5), (51, 5e-5))) if explicit else []
    planar = own + stiff + ribbon + rods + exudyn + verlet
    attempted("planar snap", planar, sweep)
    # the first is what the ratios are to
    duel: dict[str, Attempt] = {}
    for what, chosen in (
        ("The elastica", cheapest(own)),
        (DEFAULTS, own[0]),
        ("The inextensible elastica with its defaults", stiff[0]),
        ("The inextensible elastica", cheapest(stiff)),
        ("The Kirchhoff elements", cheapest(ribbon)),
        ("DER", cheapest(rods)),
        ("Exudyn, the cheapest run of all", cheapest(exudyn)),
        ("Exudyn, the cheapest run that keeps it when refined", settled(exudyn)),
    ):
        if chosen is not None and chosen not in duel.values():
            duel[what] = chosen
    taken = alternate(list(duel.values()), rounds, sweep)
    base = next(iter(duel.values())).timing.seconds
    for run in verlet:
        # too long for turns: one run against the median of the first
        if run.timing.seconds and base:
            run.keep(ratio=(None, run.timing.seconds / base, None))
    dropped = [run for run in exudyn if not run.timing.ratio and run.timing.note != "shear 100 EA"]
    return {
        "planar": tuple(run.timing for run in planar),
        "shown": tuple(k for k, run in enumerate(planar) if run not in dropped),
        "chosen": {what: run.timing for what, run in duel.items()},
        "taken": taken,
    }


def _branch(auto: bool, rounds: int, sweep: Sweep) -> tuple[Timing, ...]:
    """The static branch, by elements and by AUTO where it is."""
    program = None if peer_auto.missing() or not auto else peer_auto.Auto(BRANCH)
    try:
        static = attempted("static branch", branch_runs(program), sweep)
        for run in static:
            if run.timing.done and run.timing.off > 1e-3:
                run.keep(note="jumps onto the detached curve of equilibria: other folds")
        alternate([run for run in static if run.timing.off < 1e-6], rounds, sweep)
    finally:
        if program is not None:
            program.close()
    return tuple(run.timing for run in static)


def main(*, rounds: int = 7, explicit: bool = True, auto: bool = True, sweep: Sweep | None = None) -> Peers:
    """Run the same scenes through other programs, and compare the time that the same error costs.

    Exudyn and PyElastica come with the extra ribbonfem[peers]; AUTO-07p is a program of its own,
    found by AUTO_DIR or on the path, and needs gfortran.  A program that is missing is left out, and the
    report says so.  All runs use one thread.  CPU seconds are those of the solution alone for the others,
    and of the whole call for ours.  Two programs whose ratio is given run alternately.  --no-explicit
    leaves out the long runs of PyElastica.
    """
    alone = here(sweep)
    whole_number("rounds", rounds, 1, 1000)
    lacking = [
        text for text in (peer_exudyn.missing(), peer_pyelastica.missing(), peer_auto.missing()) if text
    ]
    # compiled before any clock starts
    short = replace(PLANAR, stop=1e-3)
    elastica.simulate(short, extensible=True)
    kirchhoff.simulate(short, extensible=True)
    der.simulate(short, nodes=21)
    truth, turned = attempts.planar_truth(), attempts.ribbon_truth()
    slow = explicit and not peer_pyelastica.missing()
    planar = _planar(truth, rounds, slow, alone)
    ribbon = rod_runs(RIBBON, turned) + kirchhoff_runs(RIBBON, turned, _ELEMENTS)
    ribbon += [] if peer_exudyn.missing() else exudyn_ribbon_runs(turned)
    ribbon += pyelastica_runs(RIBBON, turned, ((51, 2.5e-5),)) if slow else []
    return Peers(
        truth=truth,
        turned=turned,
        rounds=rounds,
        ribbon=tuple(run.timing for run in attempted("ribbon snap", ribbon, alone)),
        branch=_branch(auto, rounds, alone),
        lacking=tuple(lacking),
        **planar,
    )


def summary(result: Peers) -> list[str]:
    """What errors are, the ratios at equal error, what is missing."""
    return [
        "Errors are those of the angle at which z(1/2) = 0, against a limit computed here "
        f"({result.truth:.7f} rad planar, {result.turned:.5f} rad ribbon); CPU seconds on one thread.",
        *_ratios(result.chosen, result.taken),
        *(f"{lack}." for lack in result.lacking),
    ]


def tables(result: Peers) -> list[Table]:
    """Planar snap, ribbon snap, branch."""
    note = (
        f"Ratios: to the row with 1.00, {result.rounds} runs by turns (PyElastica: one run). Errors of the "
        "row without EA are against its own limit. The beams of Exudyn and PyElastica are shearable: its "
        "shear stiffness is noted, PyElastica's is what it sets, and alone moves the snap by some 1e-3."
    )
    return [
        Table.of(title, rows, _COLUMNS, said)
        for title, rows, said in (
            ("Planar snap (0.40, 0), 0.1 rad/s, nu = 1", [result.planar[k] for k in result.shown], note),
            (
                "Ribbon snap (0.40, 0.37) from U+S-, 0.1 rad/s, nu = 1",
                result.ribbon,
                "One run each. Exudyn starts from the static state of kirchhoff.",
            ),
            (
                "The branch of (0.40, 0.40): four folds, the largest error of them",
                result.branch,
                f"Ratios: to the first row, {result.rounds} runs by turns. AUTO: intervals x collocation "
                "points, and its largest step; it starts from a given state, which kirchhoff finds "
                "by itself.",
            ),
        )
    ]


def drawings(result: Peers) -> Iterator[Drawing]:
    """Errors against CPU seconds."""
    yield Drawing("peers.png", "Planar snap: error against CPU seconds.", _draw(result.planar))


def values(result: Peers) -> dict[str, Any]:
    """The numbers for programs."""
    return {
        "planar_truth": result.truth,
        "ribbon_truth": result.turned,
        "planar": [asdict(run) for run in result.planar],
        "ribbon": [asdict(run) for run in result.ribbon],
        "branch": [asdict(run) for run in result.branch],
        "chosen": {what: asdict(run) for what, run in result.chosen.items()},
        "missing": list(result.lacking),
    }


COMMAND = Command(
    name="peers",
    title="Other programs on the same scenes",
    takes="some 15 minutes with all of them",
    main=main,
    summary=summary,
    tables=tables,
    drawings=drawings,
    values=values,
)
