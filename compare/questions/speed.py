"""How fast is the rod's time loop, and where does its time go?"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import der
from compare.face.report import Picture, Section, Table
from compare.face.style import figure, save
from compare.sweep.progress import Progress
from der import kernels
from der.problem import Statics
from der.rod import Rod
from der.states import start_state
from ribbonfem import Scene

SNAP = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.1, damping=1.0, stop=0.6)
SLOW = Scene(compression=0.40, shear=0.40, rate=0.01, damping=10.0, stop=0.6)
RINGING = Scene(compression=0.40, shear=0.37, rate=0.01, damping=0.1, stop=0.6)


# calls in one timing: one takes microseconds
_OFTEN = 200


def _often(call: Callable[[], Any]) -> None:
    for _ in range(_OFTEN):
        call()


def _best(call: Callable[[], Any], repeats: int = 7) -> tuple[float, float]:
    """Best and median seconds of a call."""
    taken = []
    for _ in range(repeats):
        begin = time.perf_counter()
        call()
        taken.append(time.perf_counter() - begin)
    return min(taken), statistics.median(taken)


def reference_kernel() -> float:
    """Seconds of a fixed task on this machine: a product of two dense 300 x 300 matrices."""
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(300, 300)), rng.normal(size=(300, 300))
    a @ b
    return _best(lambda: a @ b, 40)[0]


def parts_of_an_iteration(nodes: int) -> dict[str, float]:
    """Best seconds of each kernel of a Newton iteration, called from compiled-code wrappers."""
    rod = Rod(SNAP, nodes)
    state = start_state(rod)
    problem = Statics(rod)
    tangent, inverse = problem.edges(state.x)
    gradient, energies = np.zeros(4 * nodes), np.zeros(3)
    hessian = np.zeros((4 * nodes + kernels.WIDTH, kernels.WIDTH + 1))
    first, last = rod.free.start, rod.free.stop
    m1, twist, turn = state.m1.copy(), state.twist.copy(), np.zeros(nodes)
    shifted = problem.assemble(state)[2]
    shifted[: 4 * nodes, 0] += 1e6 * rod.inertia
    factors, right = shifted.copy(), np.zeros(4 * nodes + kernels.WIDTH)

    def assemble(second: bool) -> None:
        kernels.assemble(
            tangent,
            inverse,
            m1,
            twist,
            rod.stiffness,
            rod.rest,
            rod.stretch,
            gradient,
            hessian,
            energies,
            second,
            nodes,
        )

    def factor() -> None:
        factors[:] = shifted
        kernels.factor(factors, first, last)

    calls: dict[str, Callable[[], Any]] = {
        "edges": lambda: kernels.edges(state.x, tangent, inverse),
        "frames": lambda: kernels.carry(tangent, state.m1, state.twist, tangent, turn, m1, twist),
        "forces": lambda: assemble(False),
        "forces and Hessian": lambda: assemble(True),
        "copy": lambda: factors.__setitem__(slice(None), shifted),
        "copy and factorisation": factor,
        "solve": lambda: kernels.solve(factors, first, last, right),
    }
    found = {}
    for name, call in calls.items():
        call()
        found[name] = _best(partial(_often, call), 15)[0] / _OFTEN
    return found


def main(*, progress: Progress | None = None, out: Path, nodes: int = 51, repeats: int = 5) -> Section:
    """Measure the rod's time loop on one core: steps a second, time a Newton iteration, a profile.

    Implicit Euler at 1e-3 s with Newton stopped at an update below 1e-8 L; the static start; the
    slow scenes of the delay and skipping studies to 1e-4 in their snap angles, with the error
    of each beside its time.  Every time also as a multiple of a fixed reference kernel.
    """
    progress = progress or Progress()
    for method, step in (("implicit-euler", 1e-3), ("tr-bdf2", None)):
        der.simulate(SNAP, nodes=nodes, method=method, step=step, every=10**6, configurations=False)
    unit = reference_kernel()
    euler = [
        der.simulate(
            SNAP, nodes=nodes, method="implicit-euler", step=1e-3, every=100, configurations=False
        ).stats
        for _ in progress("implicit Euler", range(repeats))
    ]
    rate = [stats["steps"] / stats["seconds"] for stats in euler]
    iteration = [stats["seconds"] / stats["newton_iterations"] for stats in euler]
    rod = Rod(SNAP, nodes)
    start_best, start_median = _best(lambda: start_state(rod), repeats)
    rows: list[list[Any]] = [
        ["implicit Euler, steps a second", max(rate), statistics.median(rate), None],
        ["implicit Euler, us a Newton iteration", 1e6 * min(iteration), 1e6 * statistics.median(iteration)]
        + [min(iteration) / unit],
        ["static start, s", start_best, start_median, start_best / unit],
    ]
    scenes = []
    for label, scene, tight in (
        ("(0.40, 0.40) to 0.6, nu 10, rate 0.01", SLOW, 1e-6),
        ("(0.40, 0.37) to 0.6, nu 0.1, rate 0.01", RINGING, 3e-6),
    ):
        reference = der.simulate(scene, nodes=nodes, tolerance=tight, configurations=False)
        taken = []
        for _ in progress(label, range(repeats)):
            history = der.simulate(scene, nodes=nodes, configurations=False)
            taken.append(history.stats["seconds"])
        errors = []
        for quantity in ("slope", "height"):
            ours, truth = history.crossing(quantity), reference.crossing(quantity)
            errors.append(None if ours is None or truth is None else ours[1] - truth[1])
        stats = history.stats
        scenes.append(
            [label, min(taken), statistics.median(taken), min(taken) / unit, *errors]
            + [stats["steps"], stats["newton_iterations"], stats["rejected"]]
        )
    parts = parts_of_an_iteration(nodes)
    factorisation = parts["copy and factorisation"] - parts["copy"]
    stacked = {
        "edges and frames": parts["edges"] + parts["frames"],
        "forces and Hessian": parts["forces and Hessian"],
        "factorisation": factorisation,
        "solve": parts["solve"],
    }
    kept = {
        "edges and frames": stacked["edges and frames"],
        "forces": parts["forces"],
        "solve": parts["solve"],
    }
    fig, axes = figure(1, width=7.0, height=2.2)
    for row, group in enumerate((stacked, kept)):
        left = 0.0
        for k, (name, seconds) in enumerate(group.items()):
            axes.barh(row, 1e6 * seconds, left=left, color=f"C{k}", edgecolor="white")
            axes.text(left + 5e5 * seconds, row, name, ha="center", va="center", fontsize=6.5)
            left += 1e6 * seconds
    axes.set_yticks([0, 1], ["new factors", "kept factors"])
    axes.set(xlabel=f"microseconds of a Newton iteration, N = {nodes}", ylim=(-0.6, 1.6))
    picture = save(fig, out / "speed-profile.png")
    return Section(
        name="speed",
        title="The rod's time loop",
        text=[
            f"{statistics.median(rate):.0f} steps of implicit Euler a second (median of {repeats}; "
            f"N = {nodes}, step 1e-3 s, Newton's update below 1e-8 L) and "
            f"{1e6 * statistics.median(iteration):.1f} us a Newton iteration. The reference kernel, a dense "
            f"300 x 300 matrix product, takes {1e6 * unit:.0f} us here.",
        ],
        tables=[
            Table(
                "The loop alone",
                ["what", "best", "median", "in reference kernels"],
                rows,
                ["s", ".4g", ".4g", ".3g"],
            ),
            Table(
                "Slow ramps with the default policy (TR-BDF2), errors against tight ones",
                [
                    "scene",
                    "best (s)",
                    "median (s)",
                    "in reference kernels",
                    "error of t_z = 0",
                    "error of z = 0",
                ]
                + ["steps", "iterations", "rejected"],
                scenes,
                ["s", ".3f", ".3f", ".3g", "+.1e", "+.1e", "d", "d", "d"],
                "Errors in rad, on the same mesh; z = 0 of the second scene comes long after the first snap, "
                "out of a vibration that magnifies every difference.",
            ),
            Table(
                "Parts of a Newton iteration",
                ["part", "us"],
                [
                    [name, 1e6 * seconds]
                    for name, seconds in (*stacked.items(), ("forces alone", parts["forces"]))
                ],
                ["s", ".2f"],
            ),
        ],
        pictures=[Picture(picture, "Where the time of an iteration goes, with new and with kept factors.")],
        values={
            "steps_per_second": rate,
            "seconds_per_iteration": iteration,
            "reference_kernel": unit,
            "start": [start_best, start_median],
            "scenes": scenes,
            "parts": parts,
        },
    )
