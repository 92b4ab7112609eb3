"""The command `stability`: all hard cases run, judged by `judging.py` and `hard_statics.py`, and drawn."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import der
from compare.archive import for_programs
from compare.report.registry import Command
from compare.report.section import Drawing, Table
from compare.studies.study import Study
from compare.sweep import Sweep
from ribbonfem import Scene

from . import maps
from .hard_cases import (
    CASES,
    COARSE,
    GOOD,
    KIRCHHOFF,
    KNOWN,
    LOSSY,
    PATH_1,
    PLANAR,
    RAISED,
    REFUSED,
    RODS,
    SKIPPED,
    UNBALANCED,
    UNRESOLVED,
    WRONG,
    Hard,
    MotionVerdict,
)
from .hard_statics import SOUND, TOLD, StaticVerdict, judge_statics, static_scenes
from .judging import (
    CONFIRMED,
    DEFAULTS,
    ELEMENTS,
    EXPLICIT_MOST,
    METHODS,
    MOST,
    Confirmation,
    confirm,
    judge,
)


def _work(item: tuple[Any, ...]) -> tuple[list[Any], str, float]:
    """One piece of work: what it found, its name, and the processor's seconds that it took."""
    began = time.process_time()
    result: list[Any]
    if isinstance(item[0], Hard):
        result, name = judge(*item), f"{item[0].name}, {item[1]}"
    elif isinstance(item[0], Confirmation):
        result, name = [confirm(*item)], f"{item[0].case}, {item[0].model} {item[0].method}"
    else:
        result, name = list(judge_statics(*item)), f"{item[0]}, at rest"
    return result, name, time.process_time() - began


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
    # motions first and the scenes at rest, which take one or two seconds each, last: all processes
    # are then busy to the end
    work: list[Any] = [(each,) for each in CONFIRMED]
    for case in CASES:
        work += [(case, model) for model in METHODS if model in (RODS, KIRCHHOFF) or case.scene.planar]
    work += list(static_scenes().items())
    done = Study("hard cases", _work, work, prepare=_warm_up).results(sweep or Sweep())
    result = [v for group, _, _ in done for v in group]
    return HardCases(
        runs=tuple(v for v in result if isinstance(v, MotionVerdict)),
        statics=tuple(v for v in result if isinstance(v, StaticVerdict)),
        confirmed=tuple(v for v in result if isinstance(v, Confirmation)),
        seconds={name: seconds for _, name, seconds in done},
    )


def _defaults(verdicts: Sequence[MotionVerdict]) -> list[MotionVerdict]:
    """The default runs of motions that exist: those that have to survive."""
    absent = {(case.name, model) for case in CASES for model, _ in case.refused}
    return [v for v in verdicts if v.method == DEFAULTS[v.model] and (v.case, v.model) not in absent]


def _failures(defaults: Sequence[MotionVerdict]) -> str:
    failed = [v for v in defaults if v.status not in (GOOD, LOSSY)]
    return "; ".join(f"{v.model}, {v.case}: {v.status}, {v.note}" for v in failed)


def _failed_at_rest(statics: Sequence[StaticVerdict]) -> str:
    fine = (SOUND, TOLD)
    failed = [f"{v.model} {v.function}, {v.scene}: {v.status}" for v in statics if v.status not in fine]
    return f"Not right: {'; '.join(failed)}." if failed else ""


def _meshes(defaults: Sequence[MotionVerdict]) -> str:
    """What the finer meshes say of the rods' snaps."""
    parts = []
    for unit, said in (("rad", "rad of the clamp"), ("wait", "of the wait")):
        off = [v for v in defaults if v.model == RODS and v.unit == unit and v.mesh is not None]
        if off:
            middle = float(np.median([v.mesh for v in off if v.mesh is not None]))
            most = max(off, key=lambda v: v.mesh or 0.0)
            parts.append(
                f"{middle:.1e} {said} in the median of {len(off)} and {most.mesh:.1e} at most ({most.case})"
            )
    return (
        "The rods of a case have its own mesh, mostly 51 nodes; one twice as fine moves their snap by "
        + ", by ".join(parts)
        + ": shown and not judged."
    )


def _confirmations(confirmed: Sequence[Confirmation]) -> str:
    kept = [c for c in confirmed if c.error is not None and c.allowed is not None and c.error <= c.allowed]
    return (
        f"References confirmed: {len(kept)} of {len(confirmed)} snaps by another integrator with small fixed "
        "steps are as close to the reference as a default run has to be."
    )


def summary(result: HardCases) -> list[str]:
    """How many there are of each status, and which default runs failed."""
    counts = Counter(v.status for v in result.runs)
    still = Counter(v.status for v in result.statics)
    defaults = _defaults(result.runs)
    survived = sum(v.status in (GOOD, LOSSY) for v in defaults)
    failures = _failures(defaults)
    damped = [v for v in defaults if v.status == LOSSY]
    worst = max((-(v.drift or 0.0) for v in damped), default=0.0)
    return [
        f"{len({v.case for v in result.runs})} cases, {len(result.runs) - counts[SKIPPED]} runs: "
        f"{counts[GOOD]} completed, {counts[LOSSY]} completed with more than 5 % of the kinetic energy lost "
        "to the method, "
        f"{counts[UNBALANCED]} are right so far but gain more than 25 % of it, "
        f"{counts[COARSE]} are right on their mesh and off against a finer one, "
        f"{counts[UNRESOLVED]} are off and their own energy balance says that the step is too long, "
        f"{counts[RAISED]} raised an error that says why, {counts[REFUSED]} were refused by the name of "
        f"what cannot be, {counts[WRONG]} are wrong without saying so; {counts[SKIPPED]} were left out.",
        f"The default steps of all models, on the default meshes of the elements, give the right result in "
        f"{survived} of {len(defaults)} motions that exist: within 0.1 % of the snap's angle (and 2e-4 "
        f"rad), 1 % of a wait, 1 % of the height's range.  Of these, {len(damped)} lose more than "
        f"5 % of the largest kinetic energy to the method's own damping, {worst:.0%} at most."
        + (f"  Not in: {failures}." if failures else ""),
        f"{len({v.scene for v in result.statics})} scenes at rest: "
        + ", ".join(f"{number} {status}" for status, number in sorted(still.items()))
        + f".  {_failed_at_rest(result.statics)}",
        "The defaults ("
        + ", ".join(f"{method} of {model}" for model, method in DEFAULTS.items())
        + ") are adaptive with their default tolerances, the other methods have the fixed step of the case. "
        "References are adaptive at 1e-6 L (elements: 1e-7) on the same mesh, and end at the snap.",
        _meshes(defaults),
        _confirmations(result.confirmed),
        f"Left out: fixed steps, of which the motion needs more than {MOST:,} (explicit: "
        f"{EXPLICIT_MOST:,}).  The work took {sum(result.seconds.values()):.0f} s of the processor.",
    ]


def _short(note: str, most: int = 60) -> str:
    return note if len(note) <= most else note[: most - 1] + "…"


def _messages(verdicts: Sequence[MotionVerdict], statics: Sequence[StaticVerdict]) -> list[list[str]]:
    """A row for each case, model and message: whose it is, and what it says."""
    result: dict[tuple[str, str, str], tuple[list[str], str]] = {}
    messages = [
        (v.case, v.model, v.method, v.note)
        for v in verdicts
        if v.status not in (GOOD, LOSSY, SKIPPED) and v.note
    ]
    messages += [(s.scene, s.model, s.function, s.note) for s in statics if s.count is None]
    for case, model, method, note in messages:
        message = note.rpartition("It says: ")[2]
        # methods put their name first; the instant at which they stop differs
        same = "".join(c for c in message.replace(method, "") if not c.isdigit())
        result.setdefault((case, model, same[-60:]), ([], message))[0].append(method)
    rows = []
    for (case, model, _), (who, message) in result.items():
        rows.append([case, f"{model} {', '.join(who[:2])}{' ..' * (len(who) > 2)}", _short(message, 112)])
    return rows


def tables(result: HardCases) -> list[Table]:
    """Every run, every scene at rest, every reference that was confirmed."""
    return [
        Table.of(
            "References confirmed",
            result.confirmed,
            [
                *(("case", "s", "case"), ("by", "s", lambda c: f"{c.model} {c.method}")),
                *(
                    ("step (s)", ".0e", "step"),
                    ("reference (s)", ".7g", "wanted"),
                    ("found (s)", ".7g", "found"),
                ),
                *(("error", ".1e", "error"), ("of", "s", "unit"), ("allowed", ".1e", "allowed")),
                ("note", "s", "note"),
            ],
            "The instant of the snap by the reference and by an integrator that shares no step with it, "
            "both on the mesh of the case.",
        ),
        Table.of(
            "Every motion",
            [v for v in result.runs if v.status != SKIPPED],
            [
                *(("case", "s", "case"), ("method", "s", lambda v: f"{v.model} {v.method}")),
                *(("status", "s", "status"), ("error", ".1e", "error"), ("of", "s", "unit")),
                *(("finer", ".1e", "mesh"), ("drift", "+.1e", "drift"), ("snap (rad)", ".5f", "snap")),
                *(("rejected", "d", "rejected"), ("s", ".2f", "seconds")),
            ],
            "error: against the reference, of the snap's instant in rad of the clamp or as part of the wait "
            "since it stopped, else of the height in L. finer: the same against a mesh twice as fine. "
            "drift: largest gain (or, negative, loss) of energy beyond the balance, over the largest kinetic "
            "energy. rejected: steps taken again.",
        ),
        Table(
            "Why not, or why less",
            ["case", "by", "message"],
            _messages(result.runs, result.statics),
            ["s", "s", "s"],
            "Errors in their own words, and what is said against runs that completed. Methods of which the "
            "same is said but for the instant stand together, with the words of the first.",
        ),
        Table.of(
            "Every scene at rest",
            result.statics,
            [
                *((name, "s", name) for name in ("scene", "model", "function", "status")),
                *(
                    ("first fold (rad)", ".7f", "angle"),
                    ("folds", "d", "count"),
                    ("error (rad)", ".1e", "error"),
                ),
                ("note", "s", lambda s: _short(s.note)),
            ],
            "error: of the rods against the Kirchhoff elements, and of these against the rods' limit in N; "
            "elastica: against the Kirchhoff elements; quasi-linear beam: against its closed form.",
        ),
    ]


def drawings(result: HardCases) -> Iterator[Drawing]:
    """Maps of motions and of scenes at rest."""
    known = {case.name for case in KNOWN}
    planar = {case.name for case in CASES if case.scene.planar}
    for file, caption, chosen in (
        ("known", "Motions of ribbons that broke prototypes.", known - planar),
        ("ribbons", "Motions of ribbons made to be hard.", {v.case for v in result.runs} - known - planar),
        ("planar", "Planar motions: rods, Kirchhoff elements, elastica, quasi-linear beam.", planar),
    ):
        verdicts = [v for v in result.runs if v.case in chosen]
        yield Drawing(f"stability-{file}.png", caption, maps.motion_map(verdicts))
    yield Drawing("stability-rest.png", "The same scenes at rest.", maps.statics_map(result.statics))


def values(result: HardCases) -> dict[str, Any]:
    """The numbers for programs."""
    return {
        "runs": [vars(v) for v in result.runs],
        "statics": [for_programs(v) for v in result.statics],
        "confirmed": [vars(v) for v in result.confirmed],
        "seconds": result.seconds,
    }


COMMAND = Command(
    name="stability",
    title="Hard cases",
    takes="some 6 minutes",
    main=main,
    summary=summary,
    tables=tables,
    drawings=drawings,
    values=values,
)
