"""The command `figures`: the paper's figures drawn from both models, and its claims judged one by one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any, Literal

from compare.diagrams.diagram import MOST_SAMPLES, SAMPLES
from compare.report.registry import Command
from compare.report.section import Drawing, Table
from compare.reproduction.delays import DAMPINGS, require_ranges
from compare.reproduction.rate_damping import NAMED_SELECTION, NAMED_SKIPPING
from compare.sweep import Sweep
from ribbonfem.options import whole_number, within

from . import at_rest, in_motion
from . import figures_motion as motion
from . import figures_rest as rest
from .axes import FigureData, draw, to_csv
from .claims import CHOICES, CLAIMS, GROUPS
from .result import Figures, of_parts
from .verdict import CORRECTED, NO, NOT_ASKED, OPEN, YES, Claim, Verdict

NAMES = tuple(f"fig{number}" for number in range(2, 17))


def _chosen(only: Sequence[str]) -> tuple[str, ...]:
    for name in only:
        if name not in NAMES:
            raise ValueError(f"only = {name!r}: must be of {', '.join(NAMES)}, with commas between them")
    return tuple(name for name in NAMES if name in only) if only else NAMES


def main(
    *,
    only: tuple[str, ...] = (),
    cells: int = 20,
    model: Literal["der", "kirchhoff", "both"] = "der",
    samples: int = SAMPLES,
    dampings: tuple[float, ...] = DAMPINGS,
    decades: int = 5,
    phase_step: float = 0.05,
    sweep: Sweep | None = None,
) -> Figures:
    """Draw every figure of the paper that numbers make, Figs. 2 to 16, and judge its claims one by one.

    Writes figures/figN.png, .pdf and .csv, all that is drawn in it. Finite elements are lines, discrete rods
    symbols. --only fig3,fig7 draws some of them. --cells, --model, --samples: of the diagrams of Figs. 11
    and 14; runs that `ribbonfem skipping --all` and `selection --all` left in the folder are taken over.
    --dampings, --decades: of Figs. 7 to 9. --phase-step: grid of the rods in Fig. 16.
    """
    sweep = sweep or Sweep()
    chosen = _chosen(only)
    whole_number("cells", cells, 2, 100)
    whole_number("samples", samples, 1, MOST_SAMPLES)
    within("phase_step", phase_step, 0.01, 0.5)
    require_ranges(dampings, decades)
    systems = [
        name
        for name, figure in (("planar", "fig6"), ("Path 1", "fig8"), ("Path 2", "fig9"))
        if figure in chosen
    ]
    scaled = [figure for figure in in_motion.SCALED if figure in chosen]
    kinds = [
        kind
        for figure, group in (
            ("fig10", (("skipping", 0.40), ("skipping", 0.35))),
            ("fig12", (("selection", 0.40),)),
            ("fig13", (("selection", 0.35),)),
        )
        if figure in chosen
        for kind in group
    ]
    return Figures(
        chosen=chosen,
        snapshots=at_rest.snapshots(sweep) if "fig2" in chosen else (),
        planar=at_rest.planar(sweep) if "fig3" in chosen else None,
        ribbons=at_rest.ribbons(sweep) if "fig4" in chosen else None,
        swept=at_rest.swept(sweep) if "fig5" in chosen else None,
        moved={system: in_motion.moved(system, sweep) for system in systems} or None,
        delays=in_motion.scaled(scaled, tuple(dampings), decades, sweep) if scaled else None,
        width=in_motion.width_matters(1.0) if "fig8" in chosen else None,
        settled=in_motion.settled(kinds, sweep) if kinds else None,
        bounds=tuple(in_motion.bound_of(value) for value in (0.40, 0.35)) if "fig10" in chosen else (),
        skipping=in_motion.mapped("skipping", cells, model, samples, sweep) if "fig11" in chosen else None,
        selection=in_motion.mapped("selection", cells, model, samples, sweep) if "fig14" in chosen else None,
        states=at_rest.states() if "fig15" in chosen else None,
        phases=at_rest.phases(sweep, phase_step) if "fig16" in chosen else None,
    )


# of each figure the function of the parts of the result, and what it is called with besides
_DRAWN: dict[str, tuple[Any, ...]] = {
    "fig2": (rest.snapshots,),
    "fig3": (rest.planar,),
    "fig4": (rest.paths,),
    "fig5": (rest.critical,),
    "fig6": (motion.ramps,),
    "fig7": (motion.scaling,),
    "fig8": (motion.ribbon, "Path 1", "fig8"),
    "fig9": (motion.ribbon, "Path 2", "fig9"),
    **{name: (motion.named, name) for name in ("fig10", "fig12", "fig13")},
    "fig11": (lambda skipping: motion.maps(skipping, "fig11", NAMED_SKIPPING),),
    "fig14": (lambda selection: motion.maps(selection, "fig14", NAMED_SELECTION),),
    "fig15": (rest.curvatures,),
    "fig16": (rest.phases,),
}


def all_figures(result: Figures) -> Iterator[FigureData]:
    """The figures that were asked for, in order."""
    for name in result.chosen:
        function, *more = _DRAWN[name]
        yield of_parts(function, result, *more)


def judgements(result: Figures) -> list[tuple[Claim, Verdict]]:
    """Every claim with its verdict, in the order of the figures."""
    claims = sorted(CLAIMS, key=lambda claim: NAMES.index(claim.figure))
    return [(claim, claim.of(result)) for claim in claims]


def summary(result: Figures) -> list[str]:
    """How the claims fare, and how to read figures and verdicts."""
    verdicts = [verdict.verdict for _, verdict in judgements(result)]
    judged = len(verdicts) - verdicts.count(NOT_ASKED)
    counts = ", ".join(f"{verdicts.count(name)} {name}" for name in (YES, CORRECTED, OPEN, NO))
    left = (
        ""
        if judged == len(verdicts)
        else f" {len(verdicts) - judged} were not asked: their figures were left out."
    )
    return [
        f"Of {judged} claims of the paper {counts}.{left} Each verdict is computed from the numbers of its "
        "figure; the command beside it makes them.",
        "Confirmed with a correction: the statement holds, and something that the paper says with it does "
        "not. Not determined: refinement does not settle it, or nothing here was asked of it.",
        "Finite elements are lines and discrete rods symbols: they share no mechanics. figures/figN.csv "
        "has all that is drawn in figures/figN.png and figN.pdf. Fig. 1, the photographs of Fig. 2 and the "
        "sketch in Fig. 3 are not made of numbers.",
    ]


def tables(result: Figures) -> list[Table]:
    """Claims one by one, and where the paper contradicts itself."""
    judged = [(claim, verdict) for claim, verdict in judgements(result) if verdict.verdict != NOT_ASKED]
    made = [
        Table(
            f"The paper's claims, one by one: {name}",
            ["the paper says", "where", "verdict", "found", "its error", "correction", "command"],
            [
                [claim.says, claim.where, verdict.verdict, verdict.number, verdict.error, verdict.correction]
                + [claim.command]
                for claim, verdict in judged
                if claim in group
            ],
            ["s"] * 7,
        )
        for name, group in GROUPS.items()
    ]
    return [
        *(table for table in made if table.rows),
        Table(
            "Where the paper leaves a choice or contradicts itself, and what is taken here",
            ["of what", "the paper", "taken here"],
            CHOICES,
            ["s"] * 3,
        ),
    ]


def drawings(result: Figures) -> Iterator[Drawing]:
    """A picture of each figure, a PDF beside it."""
    for data in all_figures(result):
        yield Drawing(f"figures/{data.name}.png", data.caption, draw(data), vector=True)


def files(result: Figures) -> dict[str, str]:
    """The data beside each figure."""
    return {f"figures/{data.name}.csv": to_csv(data) for data in all_figures(result)}


def values(result: Figures) -> dict[str, Any]:
    """The numbers for programs."""
    return {
        "figures": [
            {"name": data.name, "caption": data.caption, "data": f"figures/{data.name}.csv"}
            for data in all_figures(result)
        ],
        "claims": [
            {"says": claim.says, "where": claim.where, "figure": claim.figure, "command": claim.command}
            | asdict(verdict)
            for claim, verdict in judgements(result)
        ],
    }


COMMAND = Command(
    name="figures",
    title="The paper's figures and claims",
    takes="some 15 minutes",
    main=main,
    summary=summary,
    tables=tables,
    drawings=drawings,
    values=values,
    files=files,
    keep=True,
    takes_over=("skipping", "selection", "delay", "cases"),
)
