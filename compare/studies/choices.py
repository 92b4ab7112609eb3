"""Does the chooser meet its tolerance?  Random scenes, each against a finer reference, and its cost."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare.archive import for_programs
from compare.chooser.choice import choose
from compare.chooser.random_scenes import random_scene
from compare.chooser.references import reference, rod
from compare.chooser.strategies import Answer
from compare.models import warm_up
from compare.report.registry import Command
from compare.report.section import Drawing, Table
from compare.sweep import Sweep
from ribbonfem import Scene, SceneError, SolverError
from ribbonfem.options import positive, refuse, whole_number
from ribbonfem.output.style import figure

from .study import Study

# a reference this much finer than the tolerance can judge
_JUDGE = 0.34
_TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6)
WORDS = {"met": "met", "missed": "falsely met", "told": "not met, and said so", "sensitive": "unsettled"}


@dataclass(frozen=True)
class SceneVerdict:
    """A scene, what was chosen for it at a tolerance, and how that turned out.

    `truth` and `uncertainty`: the reference and its own error; `error` is the chosen way's, against it, rad;
    `covered`: whether that is within what was claimed, and the reference's uncertainty.
    `seconds` are CPU of choosing and running, `always` those of a rod of 101 nodes up to the snap,
    `always_error` its error.
    """

    kind: str
    compression: float
    shear: float
    start: str
    rate: float
    damping: float
    thickness: float
    tolerance: float
    model: str
    runs: int
    value: float | None
    claimed: float
    truth: float | None
    uncertainty: float
    error: float | None
    verdict: str
    covered: bool
    flagged: bool
    seconds: float
    always: float
    always_error: float | None
    reason: str


def draw(count: int, seed: int) -> list[Scene]:
    """Scenes as in `random_scenes.random_scene`, planar and sheared in turn."""
    rng = np.random.default_rng(seed)
    return [random_scene(rng, planar=k % 2 == 0) for k in range(count)]


def judge(scene: Scene, tolerances: Sequence[float]) -> tuple[SceneVerdict, ...]:
    """Choose, run, and compare with the reference and with a rod of 101 nodes, at each tolerance."""
    begin = time.process_time()
    always = rod(scene, 101, 1e-4)
    always_seconds = time.process_time() - begin
    truth, uncertainty = reference(scene)

    def off(value: float | None) -> float | None:
        return None if value is None or truth is None else abs(value - truth)

    def judged(tolerance: float) -> SceneVerdict:
        begin = time.process_time()
        chosen = choose(scene, tolerance)
        try:
            answer = chosen.run()
        except (SceneError, SolverError):
            # an error that is raised is an answer that says that it is none
            answer = Answer(None, math.inf, False, False, 0.0, (), None)
        seconds = time.process_time() - begin
        error = off(answer.value)
        if answer.value is None and truth is None and answer.met:
            error = 0.0
        # what even the reference does not settle to a part of the tolerance is judged by no one
        if uncertainty > _JUDGE * tolerance and not (error is not None and error + uncertainty <= tolerance):
            verdict = "sensitive"
        elif not answer.met:
            verdict = "told"
        else:
            verdict = "met" if error is not None and error <= tolerance else "missed"
        return SceneVerdict(
            kind="planar" if scene.planar else "ribbon",
            compression=scene.compression,
            shear=scene.shear,
            start=scene.start,
            rate=scene.rate,
            damping=scene.damping,
            thickness=scene.ribbon.thickness,
            tolerance=tolerance,
            model=chosen.model,
            runs=len(answer.runs),
            value=answer.value,
            claimed=answer.error,
            truth=truth,
            uncertainty=uncertainty,
            error=error,
            verdict=verdict,
            covered=answer.error == math.inf or (error is not None and error <= answer.error + uncertainty),
            flagged=answer.sensitive,
            seconds=seconds,
            always=always_seconds,
            always_error=off(always),
            reason=chosen.reason,
        )

    return tuple(judged(tolerance) for tolerance in tolerances)


def _judge(arguments: tuple[Scene, tuple[float, ...]]) -> tuple[SceneVerdict, ...]:
    return judge(*arguments)


_COLUMNS = (
    *("tolerance", "scenes", "drawn", "judged", "met", "falsely_met", "covered", "called_sensitive"),
    *("error_over_claimed", "largest", "seconds", "time_ratio", "always_met"),
)


def _summary(verdicts: Sequence[SceneVerdict], tolerance: float, kind: str) -> list[Any]:
    """A row of the table of kept words."""
    group = [v for v in verdicts if v.tolerance == tolerance and kind in (v.kind, "all")]
    judged = [v for v in group if v.verdict != "sensitive"]
    share = [v.error / v.claimed for v in judged if v.error is not None and 0.0 < v.claimed < math.inf]
    return [
        tolerance,
        kind,
        len(group),
        len(judged),
        *(sum(v.verdict == word for v in judged) for word in ("met", "missed")),
        sum(v.covered for v in judged),
        sum(v.flagged for v in judged),
        float(np.median(share)) if share else None,
        max(share, default=None),
        float(np.median([v.seconds for v in group])),
        float(np.median([v.always / v.seconds for v in group])),
        sum((v.always_error if v.always_error is not None else math.inf) <= tolerance for v in judged),
    ]


def _draw(verdicts: Sequence[SceneVerdict]) -> Any:
    """Error over what was claimed, and the time saved, against the tolerance."""
    fig, (left, right) = figure(2, width=5.4, height=3.8)
    models = sorted({v.model for v in verdicts})
    for k, model in enumerate(models):
        for kind, marker in (("planar", "o"), ("ribbon", "^")):
            group = [v for v in verdicts if v.model == model and v.kind == kind and v.verdict != "sensitive"]
            if not group:
                continue
            x = [v.tolerance for v in group]
            label = f"{model}, {kind} ({len(group)})"
            share = [30.0 if v.error is None else max(v.error / max(v.claimed, 1e-12), 1e-5) for v in group]
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
    left.set(xlabel="tolerance asked for (rad)", ylabel="true error / claimed error")
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
    """What was found: each scene's verdicts, the tolerances, and the seed that drew them."""

    seed: int
    tolerances: tuple[float, ...]
    verdicts: tuple[SceneVerdict, ...]

    @property
    def summary(self) -> list[list[Any]]:
        """A row of `_COLUMNS` for each tolerance and kind of scene."""
        kinds = itertools.product(self.tolerances, ("all", "planar", "ribbon"))
        return [_summary(self.verdicts, tolerance, kind) for tolerance, kind in kinds]

    @property
    def judged(self) -> list[SceneVerdict]:
        """Those that the reference settles."""
        return [v for v in self.verdicts if v.verdict != "sensitive"]


def main(
    *,
    scenes: int = 60,
    seed: int = 2026,
    tolerances: tuple[float, ...] = _TOLERANCES,
    sweep: Sweep | None = None,
) -> Choices:
    """Check `compare.choose` on scenes drawn at random: is the tolerance met, and the error covered?

    Half of the scenes are planar, half ribbons; section, dL, dW, rate and damping are drawn with --seed.  The
    quantity is the angle of the snap, z(1/2) = 0, to each of --tolerances (rad).  Each answer is
    compared with a finer run, which a second model confirms. Its CPU time, choosing included, is compared
    with that of the discrete rod at N = 101 and a tolerance of 1e-4 L, stopped at the snap too.
    """
    whole_number("scenes", scenes, 2)
    whole_number("seed", seed, 0)
    if not tolerances:
        refuse("tolerances", tolerances, "must hold at least one")
    wanted = tuple(positive("tolerances", tolerance, 1.0) for tolerance in tolerances)
    study = Study("scenes", _judge, draw(scenes, seed), [wanted], prepare=warm_up)
    verdicts = [verdict for each in study.results(sweep or Sweep()) for verdict in each]
    return Choices(seed, wanted, tuple(verdicts))


def summary(result: Choices) -> list[str]:
    """How many tolerances were kept, and how far the references and their witnesses agree."""
    judged = result.judged
    met, missed = (sum(v.verdict == word for v in judged) for word in ("met", "missed"))
    covered, called = sum(v.covered for v in judged), sum(v.flagged for v in judged)
    count = max(1, len(judged))
    uncertainties = [v.uncertainty for v in result.verdicts if math.isfinite(v.uncertainty)]
    return [
        f"{len(result.verdicts) // len(result.tolerances)} scenes (seed {result.seed}), "
        f"{len(result.tolerances)} tolerances each: {len(judged)} answers that the reference settles to a "
        f"third of the tolerance, and {len(result.verdicts) - len(judged)} that it does not. Of the first "
        f"{met} meet it ({met / count:.1%}), {missed} say so falsely, in {covered} the claimed error covers "
        f"the true one ({covered / count:.1%}), and {called} are called sensitive.",
        f"References are wrong by {np.median(uncertainties):.1e} rad in the median, "
        f"{max(uncertainties):.1e} at most, by a coarser run and a model that shares no mechanics with them."
        if uncertainties
        else "",
    ]


def tables(result: Choices) -> list[Table]:
    """Kept tolerances and saved time, what was chosen, and the remarkable scenes."""
    return [
        Table(
            "Kept tolerances, covered errors and saved time",
            ["tolerance", "scenes", "drawn", "judged", "met", "falsely met", "covered", "called sensitive"]
            + ["error / claimed, median", "largest", "median CPU s", "time ratio", "N = 101 meets it"],
            result.summary,
            ["g", "s", "d", "d", "d", "d", "d", "d", ".2g", ".2g", ".3g", ".3g", "d"],
            "Judged: those that the reference settles. Falsely met: outside of it, without saying so. "
            "Covered: the true error is within the one claimed. Time ratio: CPU of a rod of 101 nodes "
            "(tolerance 1e-4, stopped at the snap) over the choice's and its runs', median; the last column: "
            "how often that rod is within the tolerance itself.",
        ),
        Table(
            "What was chosen",
            ["model", "half", "answers", "met", "median CPU s", "median error / tolerance"],
            _by_model(result.verdicts),
            ["s", "s", "d", "d", ".4f", ".2g"],
        ),
        Table.of(
            "Answers that were not met, not covered, or called sensitive",
            [v for v in result.verdicts if v.verdict != "met" or not v.covered or v.flagged],
            [
                ("(dL, dW), start", "s", lambda v: f"({v.compression:.3f}, {v.shear:.3f}) {v.start}"),
                *(("h", ".2g", "thickness"), ("rate", ".1e", "rate"), ("nu", ".1e", "damping")),
                *(("tolerance", ".1e", "tolerance"), ("model", "s", "model")),
                ("verdict", "s", lambda v: WORDS[v.verdict]),
                ("covered", "s", lambda v: "yes" if v.covered else "no"),
                ("flagged", "s", lambda v: "yes" if v.flagged else "no"),
                *(("error", ".1e", "error"), ("claimed", ".1e", "claimed")),
                ("reference's uncertainty", ".1e", "uncertainty"),
            ],
        ),
    ]


def drawings(result: Choices) -> Iterator[Drawing]:
    """Covered errors and saved time against the tolerance."""
    caption = "True error over the claimed one, and the time saved, of answers that the reference settles."
    yield Drawing("choices-check.png", caption, _draw(result.verdicts))


def values(result: Choices) -> dict[str, Any]:
    """The numbers for programs."""
    return {
        "seed": result.seed,
        "tolerances": result.tolerances,
        "summary": [dict(zip(_COLUMNS, row, strict=True)) for row in result.summary],
        "scenes": [for_programs(v) for v in result.verdicts],
    }


COMMAND = Command(
    name="choices",
    title="The cheapest model that will do",
    takes="some 10 minutes for 60 scenes",
    main=main,
    summary=summary,
    tables=tables,
    drawings=drawings,
    values=values,
)
