"""Hard cases, in motion and at rest: they complete, or they say why not, and are never garbage."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import der
from compare.report.registry import Command
from compare.report.section import Drawing, Table
from compare.sweep import Sweep
from ribbonfem import Scene

from . import maps
from .confirmations import CONFIRMED, Confirmation
from .hard_cases import CASES, KIRCHHOFF, KNOWN, PATH_1, PLANAR, RODS, Hard, MotionVerdict
from .hard_statics import StaticVerdict, judge_statics, static_scenes
from .judging import DEFAULTS, ELEMENTS, EXPLICIT_MOST, METHODS, MOST, confirm, judge


def _work(item: tuple[Any, ...]) -> tuple[list[Any], str, float]:
    """One piece of work: what it found, its name, and the processor's seconds that it took."""
    began = time.process_time()
    found: list[Any]
    if isinstance(item[0], Hard):
        found, name = judge(*item), f"{item[0].name}, {item[1]}"
    elif isinstance(item[0], Confirmation):
        found, name = [confirm(*item)], f"{item[0].case}, {item[0].model} {item[0].method}"
    else:
        found, name = list(judge_statics(*item)), f"{item[0]}, at rest"
    return found, name, time.process_time() - began


def _warm_up() -> None:
    """Compile everything before processes share it."""
    for method in METHODS[RODS]:
        step = None if method == DEFAULTS[RODS] else 1e-5
        der.simulate(Scene(**PATH_1, rate=10.0, stop=1e-3), nodes=11, method=method, step=step)
    for model in ELEMENTS.values():
        model.simulate(Scene(**PLANAR, rate=10.0, stop=1e-3))


@dataclass(frozen=True)
class HardCases:
    """What was found: motions, scenes at rest, references confirmed, and the seconds of each."""

    runs: tuple[MotionVerdict, ...]
    statics: tuple[StaticVerdict, ...]
    confirmed: tuple[Confirmation, ...]
    seconds: dict[str, float]


def main(*, sweep: Sweep | None = None) -> HardCases:
    """Run the hard cases with every method and model, in motion and at rest.

    Completed, energy drift, rejected steps, error against a tight reference and a finer mesh, or
    the error raised: free ringing, thin and thick, short and long ribbons, ratios of stiffness from
    1 to 1e4, shears around the pitchforks and near the taut limit, full turns of the clamp, ramps
    that stop at the fold or after whole periods, fast and overdamped ramps, coarse and fine meshes.
    """
    sweep = sweep or Sweep()
    # motions first and the scenes at rest, which take one or two seconds each, last: all processes
    # are then busy to the end
    work: list[Any] = [(asked,) for asked in CONFIRMED]
    for case in CASES:
        work += [(case, model) for model in METHODS if model in (RODS, KIRCHHOFF) or case.scene.planar]
    work += list(static_scenes().items())
    done = sweep("hard cases", _work, work, prepare=_warm_up)
    found = [v for group, _, _ in done for v in group]
    return HardCases(
        runs=tuple(v for v in found if isinstance(v, MotionVerdict)),
        statics=tuple(v for v in found if isinstance(v, StaticVerdict)),
        confirmed=tuple(v for v in found if isinstance(v, Confirmation)),
        seconds={name: seconds for _, name, seconds in done},
    )


def words(found: HardCases) -> list[str]:
    """How many completed, raised, were wrong."""
    limits = (
        f"Left out: fixed steps, of which the motion needs more than {MOST:,} (explicit: "
        f"{EXPLICIT_MOST:,}).  "
        f"The work took {sum(found.seconds.values()):.0f} s of the processor."
    )
    return [*maps.summary(found.runs, found.statics, found.confirmed, DEFAULTS), limits]


def tables(found: HardCases) -> list[Table]:
    """Every run, every scene at rest, every reference that was confirmed."""
    return maps.tables(found.runs, found.statics, found.confirmed)


def drawings(found: HardCases) -> Iterator[Drawing]:
    """Maps of motions and of scenes at rest."""
    known = {case.name for case in KNOWN}
    planar = {case.name for case in CASES if case.scene.planar}
    for file, caption, chosen in (
        ("known", "Motions of ribbons that broke prototypes.", known - planar),
        ("ribbons", "Motions of ribbons made to be hard.", {v.case for v in found.runs} - known - planar),
        ("planar", "Planar motions: rods, Kirchhoff elements, elastica, quasi-linear beam.", planar),
    ):
        verdicts = [v for v in found.runs if v.case in chosen]
        yield Drawing(f"stability-{file}.png", caption, maps.motion_map(verdicts))
    yield Drawing("stability-rest.png", "The same scenes at rest.", maps.statics_map(found.statics))


def values(found: HardCases) -> dict[str, Any]:
    """The numbers for programs."""
    return {
        "runs": [vars(v) for v in found.runs],
        "statics": [vars(v) for v in found.statics],
        "confirmed": [vars(v) for v in found.confirmed],
        "seconds": found.seconds,
    }


COMMAND = Command(
    name="stability",
    title="Hard cases",
    takes="some 6 minutes",
    main=main,
    words=words,
    tables=tables,
    drawings=drawings,
    values=values,
)
