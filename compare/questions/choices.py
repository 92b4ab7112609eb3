"""Does the chooser keep its word?  Scenes drawn at random, each against a finer reference, and its cost."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from compare.chooser.choice import choose
from compare.chooser.climb import SCATTER, endless, expected_steps
from compare.chooser.plans import Answer
from compare.chooser.trials import random_ribbon, rod_snap
from compare.face.section import Drawing, Table
from compare.face.style import figure
from compare.limits import limit_of
from compare.models import warm_up
from compare.sweep import Sweep
from ribbonfem import Scene, SceneError, SolverError, elastica
from ribbonfem.policy import whole_number

from .registry import Question

# meshes and tolerance of the ribbons' reference, and of one that would otherwise ring for minutes
_REFERENCE = ((101, 151, 201), 1e-6)
_LONG_REFERENCE = ((51, 76, 101), 1e-5)
_LONG = 2e4
# a reference this much finer than the tolerance can judge
_JUDGE = 0.34
WORDS = {"met": "met", "missed": "missed", "told": "not met, and said so", "sensitive": "sensitive"}


@dataclass(frozen=True)
class SceneVerdict:
    """A scene, what was chosen for it, and how that turned out.

    `truth` and `doubt`: the reference and its own error; `error` is the chosen way's, against it.
    `seconds` are CPU of choosing and running, `always` those of a rod of 101 nodes up to the snap,
    `always_error` its error.
    """

    kind: str
    compression: float
    shear: float
    start: str
    rate: float
    damping: float
    tolerance: float
    model: str
    runs: int
    value: float | None
    claimed: float
    truth: float | None
    doubt: float
    error: float | None
    verdict: str
    flagged: bool
    seconds: float
    always: float
    always_error: float | None
    reason: str


def draw(count: int, seed: int) -> list[tuple[Scene, float]]:
    """Scenes and tolerances: half planar, half ribbons.

    Of the planar ones dL/L is uniform in 0.02..0.5, rate log-uniform in 1e-4..1 rad/s and nu in
    1e-2..1e2 1/s; ribbons as in `trials.random_ribbon`.  Tolerances are log-uniform in 1e-4..1e-2
    rad.  The ramps have no stop.
    """
    rng = np.random.default_rng(seed)
    drawn: list[tuple[Scene, float]] = []
    for k in range(count):
        tolerance = 10.0 ** rng.uniform(-4.0, -2.0)
        if 2 * k < count:
            compression = rng.uniform(0.02, 0.5)
            rate, damping = 10.0 ** rng.uniform(-4.0, 0.0), 10.0 ** rng.uniform(-2.0, 2.0)
            scene = Scene(compression=compression, shear=0.0, start="U+", rate=rate, damping=damping)
        else:
            scene = random_ribbon(rng)
        drawn.append((scene, tolerance))
    return drawn


def _rod(scene: Scene, nodes: int, tolerance: float) -> float | None:
    found = rod_snap(scene, nodes, tolerance)[0]
    return None if math.isnan(found) else found


def reference(scene: Scene) -> tuple[float | None, float]:
    """The snap of a scene and what it may be wrong by, far finer than any choice.

    Planar: the elastica with 24 elements at 3e-7, and for its error the distance to rods of 101 and 201
    nodes, extrapolated: models that share no mechanics.  Ribbons: rods on three meshes, extrapolated,
    and the change over a decade of tolerance.
    """
    if scene.planar:
        history = elastica.simulate(
            endless(scene), elements=24, extensible=True, tolerance=3e-7, until="snap"
        )
        found = history.crossing()
        pair = [_rod(scene, nodes, 1e-5) for nodes in (101, 201)]
        if found is None or pair[0] is None or pair[1] is None:
            return None, (0.0 if found is None and pair == [None, None] else math.inf)
        rods, _ = limit_of([pair[0], pair[1]], (101, 201))
        return found[1], abs(found[1] - rods)
    meshes, tolerance = _LONG_REFERENCE if expected_steps(scene) > _LONG else _REFERENCE
    snaps = [_rod(scene, nodes, tolerance) for nodes in meshes]
    loose = _rod(scene, meshes[0], 10.0 * tolerance)
    values = [value for value in (*snaps, loose) if value is not None]
    if len(values) < 4:
        return None, (math.inf if values else 0.0)
    limit, doubt = limit_of(values[:3], meshes)
    return limit, doubt + abs(values[3] - values[0])


def judge(scene: Scene, tolerance: float) -> SceneVerdict:
    """Choose, run, and compare with the reference and with a rod of 101 nodes."""
    begin = time.process_time()
    chosen = choose(scene, tolerance)
    try:
        answer = chosen.run()
    except (SceneError, SolverError):
        # an error that is raised is an answer that says that it is none
        answer = Answer(None, math.inf, False, False, 0.0, (), None)
    seconds = time.process_time() - begin
    begin = time.process_time()
    always = _rod(scene, 101, 1e-4)
    always_seconds = time.process_time() - begin
    truth, doubt = reference(scene)

    def off(value: float | None) -> float | None:
        return None if value is None or truth is None else abs(value - truth)

    error = off(answer.value)
    if answer.value is None and truth is None and answer.met:
        error = 0.0
    # what even the reference does not settle to a part of the tolerance is judged by no one
    if doubt > _JUDGE * tolerance and not (error is not None and error + doubt <= tolerance):
        verdict = "sensitive"
    elif error is not None and error <= tolerance:
        verdict = "met"
    else:
        verdict = "missed" if answer.met else "told"
    return SceneVerdict(
        kind="planar" if scene.planar else "ribbon",
        compression=scene.compression,
        shear=scene.shear,
        start=scene.start,
        rate=scene.rate,
        damping=scene.damping,
        tolerance=tolerance,
        model=chosen.model,
        runs=len(answer.runs),
        value=answer.value,
        claimed=answer.error,
        truth=truth,
        doubt=doubt,
        error=error,
        verdict=verdict,
        flagged=answer.sensitive,
        seconds=seconds,
        always=always_seconds,
        always_error=off(always),
        reason=chosen.reason,
    )


def _judge(arguments: tuple[Scene, float]) -> SceneVerdict:
    return judge(*arguments)


def _summary(verdicts: Sequence[SceneVerdict], kind: str) -> list[Any]:
    """A row: scenes, judged, met, missed, worst, told, sensitive, cost."""
    group = [v for v in verdicts if v.kind == kind]
    judged = [v for v in group if v.verdict != "sensitive"]
    met = [v for v in judged if v.verdict == "met"]
    silent = [v.error / v.tolerance for v in judged if v.verdict == "missed" and v.error is not None]
    told = [v for v in judged if v.verdict == "told"]
    ratio = np.array([v.always / v.seconds for v in group])
    fair = [v for v in judged if v.always_error is not None]
    share = sum((v.always_error or 0.0) <= v.tolerance for v in fair) / max(1, len(fair))
    return [
        kind,
        len(group),
        len(judged),
        len(met) / max(1, len(judged)),
        len(silent),
        max(silent, default=None),
        len(told),
        *(float(q) for q in np.quantile(ratio, [0.25, 0.5, 0.75])),
        sum(v.always for v in group) / sum(v.seconds for v in group),
        share,
    ]


def _draw(verdicts: Sequence[SceneVerdict]) -> Any:
    """Error over tolerance, and the time saved, against the tolerance."""
    fig, (left, right) = figure(2, width=5.4, height=3.8)
    models = sorted({v.model for v in verdicts})
    for k, model in enumerate(models):
        for kind, marker in (("planar", "o"), ("ribbon", "^")):
            group = [v for v in verdicts if v.model == model and v.kind == kind and v.verdict != "sensitive"]
            if not group:
                continue
            x = [v.tolerance for v in group]
            label = f"{model}, {kind} ({len(group)})"
            share = [max(v.error / v.tolerance, 1e-5) if v.error is not None else 30.0 for v in group]
            left.loglog(x, share, marker, color=f"C{k}", ms=3.5, alpha=0.8, label=label)
            right.loglog(
                x,
                [v.always / v.seconds for v in group],
                marker,
                color=f"C{k}",
                ms=3.5,
                alpha=0.8,
                label=label,
            )
    left.axhline(1.0, color="k", lw=0.8)
    left.set(xlabel="tolerance asked for (rad)", ylabel="true error / tolerance")
    right.legend(fontsize=6.5, loc="center left", bbox_to_anchor=(1.0, 0.5))
    right.axhline(1.0, color="k", lw=0.8)
    right.set(xlabel="tolerance asked for (rad)", ylabel="time of a rod of 101 nodes / time of the choice")
    for label in right.get_xticklabels(minor=True):
        label.set_visible(False)
    return fig


def _by_model(verdicts: Sequence[SceneVerdict]) -> list[list[Any]]:
    """A row for each model and half: scenes, met, median time and error."""
    rows: list[list[Any]] = []
    for kind in ("planar", "ribbon"):
        for model in sorted({v.model for v in verdicts if v.kind == kind}):
            group = [v for v in verdicts if v.kind == kind and v.model == model]
            shares = [
                v.error / v.tolerance for v in group if v.error is not None and v.verdict != "sensitive"
            ]
            rows.append(
                [model, kind, len(group), sum(v.verdict == "met" for v in group)]
                + [float(np.median([v.seconds for v in group]))]
                + [float(np.median(shares)) if shares else None]
            )
    return rows


@dataclass(frozen=True)
class Choices:
    """What was found: each scene's verdict, and the seed that drew them."""

    seed: int
    verdicts: tuple[SceneVerdict, ...]

    @property
    def judged(self) -> list[SceneVerdict]:
        """Those that the reference settles."""
        return [v for v in self.verdicts if v.verdict != "sensitive"]

    @property
    def unsettled(self) -> list[SceneVerdict]:
        """Those that it does not."""
        return [v for v in self.verdicts if v.verdict == "sensitive"]


def _cost(work: tuple[Scene, float]) -> float:
    """Ribbons that ring take longest, planar scenes nothing beside them."""
    return 0.1 if work[0].planar else 1.0 + 1e-3 * expected_steps(work[0])


def main(*, scenes: int = 200, seed: int = 2026, sweep: Sweep | None = None) -> Choices:
    """Check `compare.choose` on scenes drawn at random: is the tolerance met, and what is saved?

    Half of the scenes are planar, half ribbons; dL, dW, rate, damping and tolerance are drawn with
    --seed.  The quantity is the angle of the snap, z(1/2) = 0.  Each answer is compared with a far
    finer reference, and its CPU time, choosing included, with that of the discrete rod at N = 101
    and a tolerance of 1e-4 L, stopped at the snap too.
    """
    whole_number("scenes", scenes, 2)
    whole_number("seed", seed, 0)
    sweep = sweep or Sweep()
    drawn = draw(scenes, seed)
    verdicts = sweep("scenes", _judge, drawn, cost=_cost, prepare=warm_up)
    return Choices(seed, tuple(verdicts))


def words(found: Choices) -> list[str]:
    """How many tolerances were kept, and how far the planar references agree."""
    judged, unsettled = found.judged, found.unsettled
    met = sum(v.verdict == "met" for v in judged)
    called = sum(v.flagged for v in unsettled)
    wrongly = sum(v.flagged for v in judged)
    doubts = [v.doubt for v in found.verdicts if v.kind == "planar" and math.isfinite(v.doubt)]
    return [
        f"{len(found.verdicts)} scenes (seed {found.seed}): {len(judged)} that the reference settles to a "
        f"third of the tolerance, and {len(unsettled)} sensitive ones, in which it does not. Of the first "
        f"{met} meet the tolerance asked for ({met / max(1, len(judged)):.1%}). Of the sensitive ones "
        f"{called} were called sensitive, and {wrongly} of the others.",
        f"Planar references: elastica and extrapolated rods differ by {np.median(doubts):.1e} rad in the "
        f"median, {max(doubts):.1e} at most."
        if doubts
        else "",
    ]


def tables(found: Choices) -> list[Table]:
    """Kept tolerances and saved time, what was chosen, and the remarkable scenes."""
    remarkable = [v for v in found.verdicts if v.verdict != "met" or v.flagged]
    return [
        Table(
            "Kept tolerances and saved time",
            ["half", "scenes", "judged", "met", "missed", "worst", "said so"]
            + ["time ratio, 1/4", "median", "3/4", "total", "N = 101 meets it"],
            [_summary(found.verdicts, kind) for kind in ("planar", "ribbon")],
            ["s", "d", "d", ".1%", "d", ".2f", "d", ".3g", ".3g", ".3g", ".3g", ".0%"],
            "missed: silently, worst: error over tolerance; said so: the answer said that it did not get "
            "there. Time ratio: CPU of a rod of 101 nodes (tolerance 1e-4, stopped at the snap) over the "
            "choice's and its runs'; the last column: how often that rod is within the tolerance itself.",
        ),
        Table(
            "What was chosen",
            ["model", "half", "scenes", "met", "median CPU s", "median error / tolerance"],
            _by_model(found.verdicts),
            ["s", "s", "d", "d", ".4f", ".2g"],
        ),
        Table(
            "Scenes that were not met, or called sensitive",
            ["(dL, dW), start", "rate", "nu", "tolerance", "model", "verdict", "flagged"]
            + ["error", "claimed", "reference's doubt"],
            [
                [
                    f"({v.compression:.3f}, {v.shear:.3f}) {v.start}",
                    v.rate,
                    v.damping,
                    v.tolerance,
                    v.model,
                ]
                + [WORDS[v.verdict], "yes" if v.flagged else "no", v.error, v.claimed, v.doubt]
                for v in remarkable
            ],
            ["s", ".1e", ".1e", ".1e", "s", "s", "s", ".1e", ".1e", ".1e"],
            f"Snaps apart by more than {SCATTER:g} rad come out of a rattle.",
        ),
    ]


def drawings(found: Choices) -> Iterator[Drawing]:
    """Errors and saved time against the tolerance."""
    caption = "True error over the tolerance, and the time saved. Sensitive scenes apart."
    yield Drawing("choices-check.png", caption, _draw(found.verdicts))


def values(found: Choices) -> dict[str, Any]:
    """The numbers for programs."""
    return {
        "seed": found.seed,
        "summary": [_summary(found.verdicts, kind) for kind in ("planar", "ribbon")],
        "scenes": [asdict(v) for v in found.verdicts],
    }


QUESTION = Question(
    name="choices",
    title="The cheapest model that will do",
    takes="some 15 minutes for 200 scenes",
    main=main,
    words=words,
    tables=tables,
    drawings=drawings,
    values=values,
)
