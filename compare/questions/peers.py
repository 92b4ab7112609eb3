"""Speed at equal error against other programs: planar snap, ribbon snap, the static branch."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import der
from compare.face.report import Picture, Section, Table
from compare.face.style import figure, save
from compare.peers import auto as peer_auto
from compare.peers import exudyn as peer_exudyn
from compare.peers import pyelastica as peer_pyelastica
from compare.sweep.progress import Progress
from ribbonfem import History, Scene, SolverError, elastica, kirchhoff
from ribbonfem.results import Array

# both ramps stop just after the snap, so that no code pays for the ringing that follows
PLANAR = Scene(compression=0.40, shear=0.0, start="U+", rate=0.1, damping=1.0, stop=1.165)
RIBBON = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.1, damping=1.0, stop=0.612)
BRANCH = Scene(compression=0.40, shear=0.40, start="U+S+")
FOLDS = 4
# the error in the angle of the planar snap (rad) at which codes are compared
ERROR = 1e-4
# nodes of the discrete rods
RODS = (51, 101, 201)
DEFAULTS = "The elastica with its defaults"
COLUMNS = ["code", "resolution", "step", "error", "CPU s", "ratio, min", "median", "max", "note"]
FORMATS = ["s", "s", "s", ".1e", ".3f", ".2f", ".2f", ".2f", "s"]


@dataclass
class Run:
    """One way to do a scene: what `go` returns is its error and its CPU seconds."""

    code: str
    resolution: str
    step: str
    go: Callable[[], tuple[float, float]]
    error: float | None = None
    seconds: float | None = None
    ratio: tuple[float | None, float, float | None] | None = None
    note: str = ""

    def once(self) -> float | None:
        """Run, and keep the error and the CPU seconds, or how it failed."""
        try:
            self.error, self.seconds = self.go()
        except SolverError as error:
            # the table has room for one line
            self.note = str(error).splitlines()[0][:110]
        return self.seconds

    @property
    def done(self) -> bool:
        """Whether it came to an end with the answer asked for."""
        return self.error is not None

    def row(self) -> list[Any]:
        """A row of a table."""
        ratio = self.ratio or (None, None, None)
        return [self.code, self.resolution, self.step, self.error, self.seconds, *ratio, self.note]

    def record(self) -> dict[str, Any]:
        """The row for programs."""
        names = ("code", "resolution", "step", "error", "seconds", "ratio", "note")
        return {name: getattr(self, name) for name in names}


def alternate(runs: Sequence[Run], rounds: int) -> Array:
    """Time runs by turns and keep their CPU seconds (median) and their ratios to the first of them.

    By turns, so that what else the machine does meets all of them alike.  Returns the CPU seconds
    (rounds, runs).
    """
    taken = np.array([[run.go()[1] for run in runs] for _ in range(rounds)])
    for k, run in enumerate(runs):
        ratio = taken[:, k] / taken[:, 0]
        run.seconds = float(np.median(taken[:, k]))
        run.ratio = (float(ratio.min()), float(np.median(ratio)), float(ratio.max()))
    return taken


def _snap(history: History, truth: float) -> float:
    """Error of the angle at which z(1/2) = 0."""
    found = history.crossing()
    if found is None:
        raise SolverError("z(1/2) did not change sign")
    return found[1] - truth


def _ours(simulate: Callable[..., History], truth: float, **policy: Any) -> Callable[[], tuple[float, float]]:
    def go() -> tuple[float, float]:
        begin = time.process_time()
        history = simulate(**policy)
        # of the whole call, which sets the problem up too: to our disadvantage
        return _snap(history, truth), time.process_time() - begin

    return go


def _theirs(
    simulate: Callable[..., History], truth: float, **policy: Any
) -> Callable[[], tuple[float, float]]:
    def go() -> tuple[float, float]:
        history = simulate(**policy)
        return _snap(history, truth), float(history.stats["seconds"])

    return go


def planar_truth(extensible: bool = True, elements: int = 24, step: float = 1e-3) -> float:
    """Angle of the planar snap, from two fixed steps of the elastica, extrapolated."""
    coarse, fine = (
        elastica.simulate(
            PLANAR, elements=elements, extensible=extensible, until="snap", step=size
        ).crossing()
        for size in (2.0 * step, step)
    )
    if coarse is None or fine is None:
        raise SolverError("the reference run did not snap")
    return (4.0 * fine[1] - coarse[1]) / 3.0


def ribbon_truth(nodes: int = 101, tolerance: float = 1e-5) -> float:
    """Angle of the ribbon's snap, from two meshes of `der` extrapolated."""
    dense = 2 * nodes - 1
    coarse, fine = (
        der.simulate(RIBBON, nodes=n, tolerance=tolerance, configurations=False).crossing()
        for n in (nodes, dense)
    )
    if coarse is None or fine is None:
        raise SolverError("the reference run did not snap")
    ratio = ((dense - 2) / (nodes - 2)) ** 2
    return (ratio * fine[1] - coarse[1]) / (ratio - 1.0)


def _elastica(truth: float, extensible: bool, choices: Sequence[tuple[int, float | None]]) -> list[Run]:
    runs = []
    for elements, tolerance in choices:
        go = _ours(
            elastica.simulate,
            truth,
            scene=PLANAR,
            elements=elements,
            extensible=extensible,
            tolerance=tolerance,
            until="snap",
        )
        step = "default" if tolerance is None else f"tol {tolerance:g}"
        code = "elastica FEM, EA" if extensible else "elastica FEM"
        runs.append(Run(code, f"{elements} cubic", step, go))
    return runs


def _rods(scene: Scene, truth: float) -> list[Run]:
    return [
        Run(
            "DER",
            f"{nodes} nodes",
            "default",
            _ours(der.simulate, truth, scene=scene, nodes=nodes, configurations=False),
        )
        for nodes in RODS
    ]


def _exudyn_planar(truth: float) -> list[Run]:
    # a Newton tolerance of 1e-4 makes it a third quicker than its default and costs no accuracy
    return [
        Run(
            "Exudyn",
            f"{elements} quadratic",
            f"{step:g} s",
            _theirs(
                peer_exudyn.simulate,
                truth,
                scene=PLANAR,
                elements=elements,
                step=step,
                shear=shear,
                newton_tolerance=1e-4,
            ),
            note=f"shear {shear:g} EA",
        )
        for shear in (10.0, 100.0)
        for elements in (12, 16, 20, 24, 32)
        for step in (2e-2, 1e-2, 5e-3)
    ]


def _exudyn_ribbon(truth: float) -> list[Run]:
    choices: list[tuple[int, float, bool, str]] = [
        (40, 1e-2, True, ""),
        (40, 1e-2, False, "full Newton"),
        (80, 1e-2, False, "full Newton"),
    ]
    return [
        Run(
            "Exudyn",
            f"{elements} linear",
            f"{step:g} s",
            _theirs(
                peer_exudyn.simulate,
                truth,
                scene=RIBBON,
                elements=elements,
                step=step,
                shear=1.0,
                newton_tolerance=1e-5,
                modified_newton=modified,
            ),
            note=note,
        )
        for elements, step, modified, note in choices
    ]


def _pyelastica(scene: Scene, truth: float, choices: Sequence[tuple[int, float]]) -> list[Run]:
    return [
        Run(
            "PyElastica",
            f"{nodes} nodes",
            f"{step:g} s",
            _theirs(peer_pyelastica.simulate, truth, scene=scene, nodes=nodes, step=step),
        )
        for nodes, step in choices
    ]


def cheapest(runs: Sequence[Run], error: float = ERROR) -> Run | None:
    """The cheapest of the runs whose error is at most `error`; None if there is none."""
    good = [run for run in runs if run.error is not None and abs(run.error) <= error]
    return min(good, key=lambda run: run.seconds or 0.0, default=None)


def settled(runs: Sequence[Run], error: float = ERROR) -> Run | None:
    """The cheapest run whose error, and that of all finer ones of its kind, is at most `error`.

    Errors of the mesh and of the step may have opposite signs, and cancel in some run by chance.
    Of the same kind are runs with the same note; finer ones have no fewer elements, no longer step.
    """

    def key(run: Run) -> tuple[str, int, float]:
        return run.note, int(run.resolution.split()[0]), -float(run.step.split()[0])

    def keeps(run: Run) -> bool:
        note, mesh, step = key(run)
        finer = [r for r in runs if key(r)[0] == note and key(r)[1] >= mesh and key(r)[2] >= step]
        return all(r.error is not None and abs(r.error) <= error for r in finer)

    return cheapest([run for run in runs if keeps(run)], error)


def _branch_runs(program: peer_auto.Auto | None) -> list[Run]:
    truth = [fold.angle for fold in kirchhoff.equilibria(BRANCH, elements=48).folds[:FOLDS]]

    def worst(angles: Sequence[float]) -> float:
        return float(np.abs(np.array(angles[:FOLDS]) - truth).max())

    def ours(elements: int, unstable: int) -> Callable[[], tuple[float, float]]:
        def go() -> tuple[float, float]:
            begin = time.process_time()
            folds = kirchhoff.equilibria(BRANCH, elements=elements, unstable=unstable).folds
            seconds = time.process_time() - begin
            return worst([fold.angle for fold in folds]), seconds

        return go

    runs = [
        Run("kirchhoff FEM", f"{elements} elements", "default", ours(elements, unstable), note=note)
        for elements, unstable, note in (
            (18, 1, "four folds, both ways from the start"),
            (20, 1, "the same"),
            (18, 2, "seven folds"),
            (20, 2, "seven folds"),
        )
    ]
    if program is None:
        return runs

    def theirs(**policy: Any) -> Callable[[], tuple[float, float]]:
        def go() -> tuple[float, float]:
            found = program.run(folds=FOLDS, **policy)
            return worst(found.folds), found.seconds

        return go

    for intervals, largest in ((25, 2.5), (25, 2.0), (50, 1.5), (25, 5.0)):
        run = Run(
            "AUTO-07p",
            f"{intervals} x 4",
            f"DSMAX {largest:g}",
            theirs(intervals=intervals, largest=largest),
        )
        runs.append(run)
    return runs


def _draw(runs: Sequence[Run], path: Path) -> str:
    """|Error| of the snap angle against CPU seconds, a colour a code."""
    fig, axes = figure(1, width=6.2, height=4.2)
    for marker, code in zip("osD^v", dict.fromkeys(run.code for run in runs), strict=False):
        chosen = [run for run in runs if run.code == code and run.done]
        seconds = [run.seconds for run in chosen]
        axes.loglog(seconds, [abs(run.error or 0.0) for run in chosen], marker, ms=5, alpha=0.8, label=code)
    axes.axhline(ERROR, color="0.6", lw=0.8, ls=":")
    axes.set(xlabel="CPU seconds", ylabel="error of the snap angle (rad)")
    axes.legend(fontsize=8)
    return save(fig, path)


def _verdict(chosen: dict[str, Run], taken: Array) -> list[str]:
    """Sentences on the ratios at equal error, from the CPU seconds (rounds, chosen)."""
    (_, base), *others = chosen.items()
    words = [
        f"Planar snap at an error of at most {ERROR:g} rad, CPU seconds in those of the extensible elastica "
        f"({base.resolution}, {base.step}: {base.seconds:.3f} s):"
    ]
    for what, run in others:
        if run.ratio is not None and run.error is not None:
            low, middle, high = run.ratio
            words.append(
                f"{what} ({run.resolution}, {run.step}, error {abs(run.error):.0e}): {middle:.1f} times "
                f"({low:.1f} to {high:.1f})."
            )
    names = list(chosen)
    for what in names:
        if "Exudyn" in what and DEFAULTS in names:
            ratio = taken[:, names.index(what)] / taken[:, names.index(DEFAULTS)]
            words.append(
                f"{what}: {np.median(ratio):.1f} times ({ratio.min():.1f} to {ratio.max():.1f}) what the "
                "extensible elastica takes with its defaults."
            )
    return words


def main(
    *, progress: Progress | None = None, out: Path, rounds: int = 7, explicit: bool = True, auto: bool = True
) -> Section:
    """Run the same scenes through other programs, and compare the time that the same error costs.

    Exudyn and PyElastica come with the extra ribbonfem[peers]; AUTO-07p is a program of its own,
    found by AUTO_DIR or on the path, and needs gfortran.  What is missing is left out, and said.
    One thread; CPU seconds of the solve alone of the others, of the whole call of ours; the
    ratios are of runs by turns.  --no-explicit leaves out the long runs of PyElastica.
    """
    progress = progress or Progress()
    if rounds < 1:
        raise ValueError(f"rounds = {rounds!r}: must be at least 1")
    lacking = [
        text for text in (peer_exudyn.missing(), peer_pyelastica.missing(), peer_auto.missing()) if text
    ]
    # compiled before any clock starts
    short = replace(PLANAR, stop=1e-3)
    elastica.simulate(short, extensible=True)
    der.simulate(short, nodes=21)
    truth, turned = planar_truth(), ribbon_truth()

    choices = ((10, None), (8, 1e-4), (8, 3e-5), (8, 1e-5), (16, 1e-6), (24, 1e-7))
    own, rods = _elastica(truth, True, choices), _rods(PLANAR, truth)
    stiff = _elastica(planar_truth(False), False, ((10, None), (8, 3e-5)))
    exudyn = [] if peer_exudyn.missing() else _exudyn_planar(truth)
    slow = explicit and not peer_pyelastica.missing()
    # the last is past its step limit, and says nothing
    verlet = _pyelastica(PLANAR, truth, ((25, 2.5e-5), (51, 2.5e-5), (51, 5e-5))) if slow else []
    planar = own + stiff + rods + exudyn + verlet
    for run in progress("planar snap", planar):
        run.once()
    # the first is what the ratios are to
    duel: dict[str, Run] = {}
    for what, chosen in (
        ("The elastica", cheapest(own)),
        (DEFAULTS, own[0]),
        ("The inextensible elastica with its defaults", stiff[0]),
        ("The inextensible elastica", cheapest(stiff)),
        ("DER", cheapest(rods)),
        ("Exudyn, the cheapest run of all", cheapest(exudyn)),
        ("Exudyn, the cheapest run that keeps it when refined", settled(exudyn)),
    ):
        if chosen is not None and chosen not in duel.values():
            duel[what] = chosen
    taken = alternate(list(duel.values()), rounds)
    base = next(iter(duel.values()))
    for run in verlet:
        # too long for turns: one run against the median of the first
        if run.seconds and base.seconds:
            run.ratio = (None, run.seconds / base.seconds, None)

    ribbon = _rods(RIBBON, turned)
    ribbon += [] if peer_exudyn.missing() else _exudyn_ribbon(turned)
    ribbon += _pyelastica(RIBBON, turned, ((51, 2.5e-5),)) if slow else []
    for run in progress("ribbon snap", ribbon):
        run.once()

    program = None if peer_auto.missing() or not auto else peer_auto.Auto(BRANCH)
    try:
        static = _branch_runs(program)
        for run in progress("static branch", static):
            run.once()
        for run in static:
            if run.error is not None and run.error > 1e-3:
                run.note = "jumps onto the detached curve of equilibria: other folds"
        good = [run for run in static if run.error is not None and run.error < 1e-6]
        alternate(good, rounds)
    finally:
        if program is not None:
            program.close()

    # Exudyn's grid in full is for the picture; the table has the chosen rows and those with one shear
    shown = own + stiff + rods + [r for r in exudyn if r.ratio or r.note == "shear 100 EA"] + verlet
    text = [
        "Errors are those of the angle at which z(1/2) = 0, against a limit computed here "
        f"({truth:.7f} rad planar, {turned:.5f} rad ribbon); CPU seconds on one thread.",
        *_verdict(duel, taken),
        *(f"{words}." for words in lacking),
    ]
    note = (
        f"Ratios: to the row with 1.00, {rounds} runs by turns (PyElastica: one run). Errors of the row "
        "without EA are against its own limit. The beams of Exudyn and PyElastica are shearable: its shear "
        "stiffness is noted, PyElastica's is what it sets, and alone moves the snap by some 1e-3."
    )
    return Section(
        name="peers",
        title="Other programs on the same scenes",
        text=text,
        tables=[
            Table(
                "Planar snap (0.40, 0), 0.1 rad/s, nu = 1", COLUMNS, [r.row() for r in shown], FORMATS, note
            ),
            Table(
                "Ribbon snap (0.40, 0.37) from U+S-, 0.1 rad/s, nu = 1",
                COLUMNS,
                [r.row() for r in ribbon],
                FORMATS,
                "One run each. Exudyn starts from the static state of kirchhoff.",
            ),
            Table(
                "The branch of (0.40, 0.40): four folds, the largest error of them",
                COLUMNS,
                [r.row() for r in static],
                FORMATS,
                f"Ratios: to the first row, {rounds} runs by turns. AUTO: intervals x collocation points, "
                "and its largest step; it starts from a given state, which kirchhoff finds by itself.",
            ),
        ],
        pictures=[Picture(_draw(planar, out / "peers.png"), "Planar snap: error against CPU seconds.")],
        values={
            "planar_truth": truth,
            "ribbon_truth": turned,
            "planar": [run.record() for run in planar],
            "ribbon": [run.record() for run in ribbon],
            "branch": [run.record() for run in static],
            "chosen": {what: run.record() for what, run in duel.items()},
            "missing": lacking,
        },
    )
