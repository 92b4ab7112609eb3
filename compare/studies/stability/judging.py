"""Hard cases in motion, run and judged: error against a fine reference, and energy balance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import der
from ribbonfem import History, elastica, kirchhoff, quasilinear
from ribbonfem.model_info import defaults
from ribbonfem.results import Array

from .hard_cases import (
    CASES,
    COARSE,
    ELASTICA,
    GOOD,
    KIRCHHOFF,
    LOSSY,
    QUASILINEAR,
    RAISED,
    REFUSED,
    RODS,
    SKIPPED,
    UNBALANCED,
    UNRESOLVED,
    WRONG,
    Hard,
    MotionVerdict,
    is_refusal,
    message_of,
)

FIXED = ("implicit-euler", "newmark", "generalised-alpha", "midpoint", "discrete-gradient")
BEAM_FIXED = ("implicit-euler", "newmark", "generalised-alpha")
# with adaptive steps; the others have the step of the case
MOVING = {RODS: der, KIRCHHOFF: kirchhoff, ELASTICA: elastica, QUASILINEAR: quasilinear}
DEFAULTS = {name: str(defaults(model, "simulate")["method"]) for name, model in MOVING.items()}
METHODS = {
    RODS: (DEFAULTS[RODS], *FIXED, "verlet"),
    KIRCHHOFF: (DEFAULTS[KIRCHHOFF], *BEAM_FIXED, "discrete-gradient"),
    **{name: (DEFAULTS[name], *BEAM_FIXED) for name in (ELASTICA, QUASILINEAR)},
}
ELEMENTS = {name: model for name, model in MOVING.items() if name != RODS}
# of each what it takes besides: the Kirchhoff rod stretches as the rods do
_POLICY: dict[str, dict[str, Any]] = {KIRCHHOFF: {"extensible": True, "configurations": False}}
# elements at least twice as many as those of the default
_FINER = {KIRCHHOFF: 16, ELASTICA: 32, QUASILINEAR: 64}
# nodes above which a rod twice as fine is not asked: it costs more than all else together
_FINEST = 200
# the tolerance of the references, L
TIGHT = 1e-6
# steps that the explicit oracle may take, and fixed-step methods
EXPLICIT_MOST, MOST = 300_000, 60_000


@dataclass(frozen=True)
class Deviation:
    """A run's distance from the reference, and what a good and a coarse step may miss."""

    error: float
    unit: str
    strict: float
    coarse: float


def _balance(history: History) -> Array:
    """Energy from nowhere since the start, EI2/L."""
    e = history.energies
    return np.asarray(e["kinetic"] + e["elastic"] + e["dissipated"] - e["work"] - e["elastic"][0])


def drift_of(history: History) -> tuple[float, float]:
    """Largest growth and loss of the energy beyond its balance, over the largest kinetic energy."""
    e, balance = history.energies, _balance(history)
    scale = max(float(e["kinetic"].max()), 1e-3 * float(e["elastic"].max()))
    return float(balance.max()) / scale, -float(balance.min()) / scale


def deviation(case: Hard, history: History, reference: History) -> Deviation:
    """How far a run is from the reference: by the instant of the snap, or by the height if there is none.

    After the snap a ribbon rings, and heights at late times depend on every digit.
    """
    rate, steps = abs(case.scene.rate), 2.0 * case.step
    if case.snap:
        result, wanted = history.crossing(case.snap), reference.crossing(case.snap)
        if wanted is not None and wanted[0] <= case.kink:
            strict, coarse = 2e-4 + 1e-3 * abs(wanted[1]), steps * rate + 0.03 * abs(wanted[1])
            off = math.inf if result is None else rate * abs(result[0] - wanted[0])
            return Deviation(off, "rad", strict, coarse)
        if wanted is not None:
            wait = wanted[0] - case.kink
            off = math.inf if result is None else abs(result[0] - wanted[0]) / wait
            return Deviation(off, "wait", 0.01, 0.03 + steps / wait)
        if result is not None:
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


def _until(case: Hard) -> str:
    return "snap" if case.snap == "height" else "end"


def moved(case: Hard, model: str, **options: Any) -> History:
    """The motion of a case by elements."""
    simulate: Any = ELEMENTS[model].simulate
    return simulate(case.scene, **_POLICY.get(model, {}), **options)


def reference(case: Hard, model: str) -> History:
    """A tight run on the same mesh, by which the stepping is judged."""
    if model == RODS:
        return der.simulate(
            case.scene, nodes=case.nodes, tolerance=TIGHT, until=_until(case), configurations=False
        )
    return moved(case, model, tolerance=0.1 * TIGHT, until=_until(case))


def finer(case: Hard, model: str) -> History | None:
    """The motion on a mesh twice as fine, at a tenth of the default tolerance; None if it costs too much."""
    if model != RODS:
        return moved(case, model, elements=_FINER[model], tolerance=TIGHT, until=_until(case))
    if case.nodes > _FINEST:
        return None
    nodes = 2 * (case.nodes - 2) + 2
    return der.simulate(
        case.scene, nodes=nodes, tolerance=10 * TIGHT, until=_until(case), configurations=False
    )


def run(case: Hard, model: str, method: str) -> History | None:
    """The motion by one method, or None if it would take too many steps.

    The default method has its adaptive steps, the others the case's.
    """
    step = None if method == DEFAULTS[model] else explicit_step(case) if method == "verlet" else case.step
    if step is not None and case.duration / step > (EXPLICIT_MOST if method == "verlet" else MOST):
        return None
    if model == RODS:
        every = 1 if step is None else max(1, int(case.duration / step / 20000))
        return der.simulate(
            case.scene, nodes=case.nodes, method=method, step=step, every=every, configurations=False
        )
    return moved(case, model, method=method, step=step)


def judge_run(case: Hard, model: str, method: str, history: History, truth: History) -> MotionVerdict:
    """Say how a run that completed did: its numbers, its energy balance, its distance from the truth."""
    growth, loss = drift_of(history)
    snap = history.crossing(case.snap) if case.snap else None
    off = deviation(case, history, truth)
    strict = method == DEFAULTS[model]

    def verdict(status: str, note: str, drift: float) -> MotionVerdict:
        return MotionVerdict(
            case.name,
            model,
            method,
            status,
            note,
            drift,
            off.error if math.isfinite(off.error) else None,
            off.unit,
            None,
            None if snap is None else snap[1],
            int(history.stats["rejected"]),
            float(history.stats["seconds"]),
        )

    if not all(np.isfinite(values).all() for values in (history.height, *history.energies.values())):
        return verdict(WRONG, "not finite", growth)
    if model in dict(case.refused):
        return verdict(WRONG, f"should have refused: {dict(case.refused)[model]}", growth)
    if growth > 0.25 and case.scene.damping == 0.0:
        return verdict(WRONG, f"gains {growth:.0%} of the kinetic energy", growth)
    if growth > 0.25 and off.error > off.strict:
        # without damping of their own, methods swing about the slow motion when steps are longer than 1/nu
        return verdict(UNRESOLVED, "its own energy balance says that the step is too long for nu", growth)
    if not off.error <= (off.strict if strict else off.coarse):
        what = (
            "one snaps, the other does not" if math.isinf(off.error) else f"off by {off.error:.2g} {off.unit}"
        )
        if loss > (0.25 if case.snap else 0.05) and not strict:
            return verdict(UNRESOLVED, f"its balance misses {loss:.0%} of the kinetic energy; {what}", -loss)
        return verdict(WRONG, what, growth if growth > loss else -loss)
    # of a creeping ribbon a quarter of the kinetic energy is nothing; then the elastic one is what counts
    if growth > 0.25 and _balance(history).max() > 0.01 * float(history.energies["elastic"].max()):
        return verdict(UNBALANCED, f"right so far, but gains {growth:.3g} of the kinetic energy", growth)
    if loss > 0.05:
        return verdict(LOSSY, f"loses {loss:.0%} of the kinetic energy", -loss)
    return verdict(GOOD, "", growth if growth > loss else -loss)


def with_mesh(case: Hard, verdict: MotionVerdict, history: History, fine: History) -> MotionVerdict:
    """Add what a mesh twice as fine says of a default run, and fail a beam that its mesh puts off.

    A beam's mesh is its model's default and has to keep the same limits as its steps.  A rod's
    mesh is the case's, 51 nodes or fewer, and no default: there the difference is shown and not judged.
    """
    off = deviation(case, history, fine)
    if not math.isfinite(off.error):
        note = "on a mesh twice as fine, one snaps and the other does not"
    elif off.unit != verdict.unit:
        note = f"off by {off.error:.2g} {off.unit} from a mesh twice as fine"
    else:
        note = ""
        verdict = replace(verdict, mesh=off.error)
    if verdict.model != RODS and verdict.status in (GOOD, LOSSY) and not off.error <= off.strict:
        return replace(
            verdict,
            status=COARSE,
            note=note or f"right on its mesh, off by {off.error:.2g} {off.unit} from one twice as fine",
        )
    return replace(verdict, note="; ".join(part for part in (verdict.note, note) if part))


def _failure(case: Hard, model: str, method: str, error: Exception) -> MotionVerdict:
    reason = dict(case.refused).get(model)
    note = message_of(error) if reason is None else f"{reason}. It says: {message_of(error)}"
    status = REFUSED if reason is not None and is_refusal(error) else RAISED
    return MotionVerdict(case.name, model, method, status, note)


def judge(
    case: Hard, model: str, methods: Sequence[str] | None = None, *, meshes: bool = True
) -> list[MotionVerdict]:
    """Run a case with the methods of a model, all by default, and say how each went.

    Whatever is raised is a verdict too: one method's failure must not hide another's answer.
    With `meshes`, the default method is also compared with a mesh twice as fine.
    """
    truth: History | Exception
    try:
        truth = reference(case, model)
    except Exception as error:
        truth = error
    verdicts = []
    for method in METHODS[model] if methods is None else methods:
        try:
            history = run(case, model, method)
        except Exception as error:
            verdicts.append(_failure(case, model, method, error))
            continue
        if history is None:
            verdicts.append(MotionVerdict(case.name, model, method, SKIPPED, "too many steps"))
        elif isinstance(truth, Exception):
            note = f"completed, but no reference does: {message_of(truth)}"
            status = WRONG if model in dict(case.refused) else UNRESOLVED
            verdicts.append(MotionVerdict(case.name, model, method, status, note))
        else:
            verdict = judge_run(case, model, method, history, truth)
            if meshes and method == DEFAULTS[model]:
                try:
                    fine = finer(case, model)
                except Exception as error:
                    verdict = replace(verdict, note=f"{verdict.note}; twice as fine: {message_of(error)}")
                else:
                    verdict = verdict if fine is None else with_mesh(case, verdict, history, fine)
            verdicts.append(verdict)
    return verdicts


@dataclass(frozen=True)
class Confirmation:
    """A reference beside another integrator on the same mesh with small fixed steps.

    Attributes
    ----------
    wanted, found: instant of the snap by the reference and by the other integrator, s.
    error, unit, allowed: the difference, and the most that a default run may be off.
    """

    case: str
    model: str
    method: str
    step: float
    wanted: float | None = None
    found: float | None = None
    error: float | None = None
    unit: str = ""
    allowed: float | None = None
    note: str = ""


# integrators that share no step with the references, at steps where they have converged
CONFIRMED = (
    Confirmation("free ringing", RODS, "discrete-gradient", 2e-4),
    Confirmation("rate 100", RODS, "verlet", 5e-6),
    Confirmation("alpha to 3.5", RODS, "generalised-alpha", 2e-4),
    Confirmation("silicon, 0.3 mm", RODS, "discrete-gradient", 2e-9),
    Confirmation("EI1/EI2 1e4", RODS, "discrete-gradient", 2e-4),
    Confirmation("planar ringing", ELASTICA, "newmark", 1e-4),
    Confirmation("planar, rate 1000", QUASILINEAR, "generalised-alpha", 1e-5),
)


def confirm(confirmation: Confirmation) -> Confirmation:
    """Set a reference beside another integrator, both on the case's mesh."""
    case = next(case for case in CASES if case.name == confirmation.case)
    try:
        truth = reference(case, confirmation.model)
        options: dict[str, Any] = {"method": confirmation.method, "step": confirmation.step, "until": "snap"}
        if confirmation.model == RODS:
            other = der.simulate(case.scene, nodes=case.nodes, configurations=False, **options)
        else:
            other = moved(case, confirmation.model, **options)
    except Exception as error:
        return replace(confirmation, note=message_of(error))
    off = deviation(case, other, truth)
    wanted, result = truth.crossing(case.snap), other.crossing(case.snap)
    return replace(
        confirmation,
        wanted=None if wanted is None else wanted[0],
        found=None if result is None else result[0],
        error=off.error if math.isfinite(off.error) else None,
        unit=off.unit,
        allowed=off.strict,
    )
