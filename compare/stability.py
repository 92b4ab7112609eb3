"""What do the hard cases do to each method and model?  They complete, or they say why not: never garbage."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import der
from ribbonfem import History, Scene, SolverError, elastica, quasilinear

from .hard_cases import CASES, ELASTICA, KNOWN, PATH_1, PLANAR, QUASILINEAR, RODS, Hard
from .hard_statics import StaticVerdict, judge_statics, static_scenes
from .pool import in_parallel
from .progress import Progress
from .report import Picture, Section, Table
from .stability_maps import motion_map, statics_map

FIXED = ("implicit-euler", "newmark", "generalised-alpha", "midpoint", "discrete-gradient")
BEAM_FIXED = ("implicit-euler", "newmark", "generalised-alpha")
DEFAULT = "tr-bdf2"
METHODS = {
    RODS: (DEFAULT, *FIXED, "verlet"),
    ELASTICA: (DEFAULT, *BEAM_FIXED),
    QUASILINEAR: (DEFAULT, *BEAM_FIXED),
}
_BEAMS = {ELASTICA: elastica, QUASILINEAR: quasilinear}
# the tolerance of the references, L
TIGHT = 1e-6
# steps that the explicit oracle may take, and fixed-step methods
_EXPLICIT_MOST, _MOST = 300_000, 60_000

GOOD, LOSSY, UNRESOLVED, RAISED, REFUSED, WRONG, SKIPPED = STATUSES = (
    "good",
    "loses energy",
    "unresolved",
    "raised",
    "no such motion",
    "WRONG",
    "skipped",
)


@dataclass(frozen=True)
class Verdict:
    """How a method did on a case.

    Attributes
    ----------
    drift: largest gain (or, negative, loss) of energy beyond the balance, over the largest kinetic energy.
    error, unit: against the reference: of the snap's instant, in "rad" of the clamp on the ramp or as
        part of the "wait" since it stopped; of the height, in "L", where there is no snap.
    snap: clamp angle at the snap, rad.
    rejected: steps taken again, halved or shortened.
    """

    case: str
    model: str
    method: str
    status: str
    note: str = ""
    drift: float | None = None
    error: float | None = None
    unit: str = ""
    snap: float | None = None
    rejected: int | None = None
    seconds: float | None = None


@dataclass(frozen=True)
class Deviation:
    """A run's distance from the reference, and what a good and a coarse step may miss."""

    error: float
    unit: str
    strict: float
    coarse: float


def drift_of(history: History) -> tuple[float, float]:
    """Largest growth and loss of the energy beyond its balance, over the largest kinetic energy."""
    e = history.energies
    balance = e["kinetic"] + e["elastic"] + e["dissipated"] - e["work"] - e["elastic"][0]
    scale = max(float(e["kinetic"].max()), 1e-3 * float(e["elastic"].max()))
    return float(balance.max()) / scale, -float(balance.min()) / scale


def deviation(case: Hard, history: History, reference: History) -> Deviation:
    """How far a run is from the reference: by the instant of the snap, or by the height if there is none.

    After the snap a ribbon rings, and heights at late times depend on every digit.
    """
    rate, steps = abs(case.scene.rate), 2.0 * case.step
    if case.snap:
        found, wanted = history.crossing(case.snap), reference.crossing(case.snap)
        if wanted is not None and wanted[0] <= case.kink:
            strict, coarse = 2e-4 + 1e-3 * abs(wanted[1]), steps * rate + 0.03 * abs(wanted[1])
            off = math.inf if found is None else rate * abs(found[0] - wanted[0])
            return Deviation(off, "rad", strict, coarse)
        if wanted is not None:
            wait = wanted[0] - case.kink
            off = math.inf if found is None else abs(found[0] - wanted[0]) / wait
            return Deviation(off, "wait", 0.01, 0.03 + steps / wait)
        if found is not None:
            return Deviation(math.inf, "rad", 0.0, 0.0)
    off = float(np.abs(np.interp(history.time, reference.time, reference.height) - history.height).max())
    reach = float(np.ptp(reference.height))
    with np.errstate(invalid="ignore"):
        speed = float(np.abs(np.diff(reference.height) / np.diff(reference.time)).max())
    return Deviation(off, "L", 2e-4 + 0.01 * reach, 2e-4 + 0.03 * reach + min(steps * speed, 0.1))


def explicit_step(case: Hard) -> float:
    """A step (s) that the explicit method can take: 0.8 of its limit in bending and in stretch."""
    ribbon, edges = case.scene.ribbon, case.nodes - 2
    stiffest = max(1.0, ribbon.bending_ratio)
    frequency = max(4.0 * edges**2 * math.sqrt(stiffest), 2.0 * edges * math.sqrt(ribbon.stretch_ratio))
    return 1.6 / frequency * ribbon.inertial_time


def reference(case: Hard, model: str) -> History:
    """A tight run on the same mesh: what is judged is the stepping."""
    until = "snap" if case.snap == "height" else "end"
    if model == RODS:
        return der.simulate(case.scene, nodes=case.nodes, tolerance=TIGHT, until=until, configurations=False)
    return _BEAMS[model].simulate(case.scene, tolerance=0.1 * TIGHT, until=until)


def run(case: Hard, model: str, method: str) -> History | None:
    """The motion by one method, or None if it would take too many steps.

    The default method has its adaptive steps, the others the case's.
    """
    step = None if method == DEFAULT else explicit_step(case) if method == "verlet" else case.step
    if step is not None and case.duration / step > (_EXPLICIT_MOST if method == "verlet" else _MOST):
        return None
    if model == RODS:
        every = 1 if step is None else max(1, int(case.duration / step / 20000))
        return der.simulate(
            case.scene, nodes=case.nodes, method=method, step=step, every=every, configurations=False
        )
    return _BEAMS[model].simulate(case.scene, method=method, step=step)


def judge_run(case: Hard, model: str, method: str, history: History, truth: History) -> Verdict:
    """Say how a run that completed did: its numbers, its energy balance, its distance from the truth."""
    growth, loss = drift_of(history)
    snap = history.crossing(case.snap) if case.snap else None
    off = deviation(case, history, truth)
    strict = method == DEFAULT

    def verdict(status: str, note: str, drift: float) -> Verdict:
        return Verdict(
            case.name,
            model,
            method,
            status,
            note,
            drift,
            off.error if math.isfinite(off.error) else None,
            off.unit,
            None if snap is None else snap[1],
            int(history.stats["rejected"]),
            float(history.stats["seconds"]),
        )

    if not all(np.isfinite(values).all() for values in (history.height, *history.energies.values())):
        return verdict(WRONG, "not finite", growth)
    if growth > 0.25 and case.scene.damping == 0.0:
        return verdict(WRONG, f"gains {growth:.0%} of the kinetic energy", growth)
    if growth > 0.25 and off.error > off.strict:
        # without damping of their own, methods swing about the slow motion when steps are longer than 1/nu
        return verdict(UNRESOLVED, "its own energy balance says that the step is too long for nu", growth)
    if not off.error <= (off.strict if strict else off.coarse):
        what = (
            "one snaps, the other does not" if math.isinf(off.error) else f"off by {off.error:.2g} {off.unit}"
        )
        if loss > 0.25 and not strict:
            return verdict(UNRESOLVED, f"its balance misses {loss:.0%} of the kinetic energy; {what}", -loss)
        if loss > 0.05 and not case.snap and not strict:
            return verdict(LOSSY, f"loses {loss:.0%} of the kinetic energy; {what}", -loss)
        return verdict(WRONG, what, growth if growth > loss else -loss)
    if loss > 0.05:
        return verdict(LOSSY, f"loses {loss:.0%} of the kinetic energy", -loss)
    return verdict(GOOD, "", growth if growth > loss else -loss)


def _failure(case: Hard, model: str, method: str, error: Exception) -> Verdict:
    refused = dict(case.refused).get(model)
    note = str(error) if refused is None else f"{refused}. It says: {error}"
    return Verdict(case.name, model, method, RAISED if refused is None else REFUSED, note)


def judge(case: Hard, model: str, methods: Sequence[str] | None = None) -> list[Verdict]:
    """Run a case with the methods of a model, all by default, and say how each went."""
    methods = METHODS[model] if methods is None else methods
    try:
        truth = reference(case, model)
    except (SolverError, ValueError) as error:
        return [_failure(case, model, method, error) for method in methods]
    verdicts = []
    for method in methods:
        try:
            history = run(case, model, method)
        except (SolverError, ValueError) as error:
            verdicts.append(_failure(case, model, method, error))
            continue
        if history is None:
            verdicts.append(Verdict(case.name, model, method, SKIPPED, "too many steps"))
        else:
            verdicts.append(judge_run(case, model, method, history, truth))
    return verdicts


def _work(item: tuple[Any, Any]) -> list[Verdict] | list[StaticVerdict]:
    return judge(*item) if isinstance(item[0], Hard) else judge_statics(*item)


def _warm_up() -> None:
    """Compile everything before processes share it."""
    for method in METHODS[RODS]:
        step = None if method == DEFAULT else 1e-5
        der.simulate(Scene(**PATH_1, rate=10.0, stop=1e-3), nodes=11, method=method, step=step)
    for beam in _BEAMS.values():
        beam.simulate(Scene(**PLANAR, rate=10.0, stop=1e-3))


def _summary(verdicts: Sequence[Verdict], statics: Sequence[StaticVerdict]) -> list[str]:
    counts = {status: sum(v.status == status for v in verdicts) for status in STATUSES}
    still = {status: sum(v.status == status for v in statics) for status in {v.status for v in statics}}
    defaults = [v for v in verdicts if v.method == DEFAULT and v.status != REFUSED]
    survived = sum(v.status in (GOOD, LOSSY) for v in defaults)
    return [
        f"{len({v.case for v in verdicts})} cases, {len(verdicts) - counts[SKIPPED]} runs: {counts[GOOD]} "
        f"completed, {counts[LOSSY]} completed with a loss of energy to the method's own damping, "
        f"{counts[UNRESOLVED]} are off and their own energy balance says that the step is too long, "
        f"{counts[RAISED]} raised an error that says why, {counts[REFUSED]} are of models that have no such "
        f"motion and say so, {counts[WRONG]} are wrong without saying so; {counts[SKIPPED]} were left out, "
        f"of more than {_MOST:,} steps (explicit: {_EXPLICIT_MOST:,}).",
        f"The default steps of the three models give the right result in {survived} of {len(defaults)} "
        "motions: within 0.1 % of the snap's angle (and 2e-4 rad), 1 % of a wait, 1 % of the height's range.",
        "At rest: " + ", ".join(f"{number} {status}" for status, number in sorted(still.items())) + ".",
        "tr-bdf2 is adaptive with its default tolerance, the other methods have the fixed step of the case. "
        "References are adaptive at 1e-6 L (beams: 1e-7) on the same mesh, and end at the snap.",
    ]


def _tables(verdicts: Sequence[Verdict], statics: Sequence[StaticVerdict]) -> list[Table]:
    rows = [
        [
            v.case,
            f"{v.model} {v.method}",
            v.status,
            v.error,
            v.unit,
            v.drift,
            v.snap,
            v.rejected,
            v.seconds,
            v.note[:110],
        ]
        for v in verdicts
        if v.status != SKIPPED
    ]
    return [
        Table(
            "Every motion",
            ["case", "method", "status", "error", "of", "drift", "snap (rad)", "rejected", "s", "note"],
            rows,
            ["s", "s", "s", ".1e", "s", "+.1e", ".5f", "d", ".2f", "s"],
            "error: against the reference, of the snap's instant in rad of the clamp or as part of the wait "
            "since it stopped, else of the height in L. drift: largest gain (or, negative, loss) of energy "
            "beyond the balance, over the largest kinetic energy. rejected: steps taken again.",
        ),
        Table(
            "Every scene at rest",
            ["scene", "model", "verb", "status", "first fold (rad)", "folds", "error (rad)", "note"],
            [[s.scene, s.model, s.verb, s.status, s.angle, s.count, s.error, s.note[:110]] for s in statics],
            ["s", "s", "s", "s", ".7f", "d", ".1e", "s"],
            "error: of the rods against the Kirchhoff elements, and of these against the rods' limit in N; "
            "elastica: against the Kirchhoff elements; quasi-linear beam: against its closed form.",
        ),
    ]


def main(*, progress: Progress | None = None, out: Path, processes: int = 2) -> Section:
    """Run the hard cases with every method and model, in motion and at rest.

    Completed, energy drift, rejected steps, error against a tight reference, or the error raised:
    free ringing, thin and thick, short and long ribbons, ratios of stiffness from 1 to 1e4, shears
    around the pitchforks and near the taut limit, full turns of the clamp, ramps that stop at the
    fold or after whole periods, fast and overdamped ramps, coarse and fine meshes.
    """
    progress = progress or Progress()
    _warm_up()
    work: list[Any] = []
    for case in CASES:
        work += [(case, model) for model in METHODS if model == RODS or case.scene.planar]
    work += list(static_scenes().items())
    found = list(progress("hard cases", in_parallel(_work, work, processes), len(work)))
    verdicts = [v for group in found for v in group if isinstance(v, Verdict)]
    statics = [v for group in found for v in group if isinstance(v, StaticVerdict)]
    known = {case.name for case in KNOWN}
    planar = {case.name for case in CASES if case.scene.planar}
    pictures = [
        Picture(
            motion_map([v for v in verdicts if v.case in known - planar], out / "stability-known.png"),
            "Motions of ribbons that broke prototypes.",
        ),
        Picture(
            motion_map([v for v in verdicts if v.case not in known | planar], out / "stability-ribbons.png"),
            "Motions of ribbons made to be hard.",
        ),
        Picture(
            motion_map([v for v in verdicts if v.case in planar], out / "stability-planar.png"),
            "Planar motions: rods, elastica, quasi-linear beam.",
        ),
        Picture(statics_map(statics, out / "stability-rest.png"), "The same scenes at rest."),
    ]
    return Section(
        name="stability",
        title="Hard cases",
        text=_summary(verdicts, statics),
        tables=_tables(verdicts, statics),
        pictures=pictures,
        values={
            "runs": [vars(v) for v in verdicts],
            "statics": [vars(v) for v in statics],
        },
    )
