"""Public `simulate` of the ribbon: from a scene to arrays and through the compiled time loop.

With lengths in L, forces in EI2/L^2, time in t*, c = EI2 / (EA L^2) or 0, the rod has the energy

    int [ 1/2 (EI1 kappa1^2 + EI2 kappa2^2 + GJ tau^2) + n.(r' - t) - c (n.t)^2 / 2 ] ds

and the inertia of r and of the rotation about the tangent (`Ribbon.rotary_inertia`): what the
discrete rods tend to.  Bending rotations and n carry no mass and follow at the same instant.
Damping is -nu M v on both.  Spin is balanced as in the rods and the paper, J theta''; the full
d(J theta' t)/dt has a gyroscopic moment besides (`gyroscopic=True`), which does no work.

r is continuous of degree p = 5, frames are unit quaternions at the same Gauss-Lobatto nodes,
interpolated and normalised, so that an element that is turned has the same strains; n has its
values at the p Gauss points, which take all integrals; the mass is lumped.  An equilibrium of
`kirchhoff` on the same mesh is one of these equations.  The force as an unknown keeps the rod from
locking and serves c = 0 and c > 0 alike, snap angles converge with the power 2 p = 10 of the
mesh, and inside the elements everything is eliminated (`tangent`): six unknowns a node.  What is
done for an element is done for four of them at once (`jit.simd`).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from ribbonfem.continuation.curves import steps_for
from ribbonfem.continuation.saddles import lowest_saddle
from ribbonfem.ends import moving
from ribbonfem.options import checked, options_given, require_duration
from ribbonfem.results import History, RestState, snaps_since
from ribbonfem.scene import Scene
from ribbonfem.stepping.control import LARGEST_TURN, Control
from ribbonfem.stepping.methods import ALL_METHODS
from ribbonfem.tableaus import Tableau

from . import initial_states, states
from .kernels import arrays
from .kernels.rod import P
from .loop import integrate, ramp_of
from .problem import checked_mesh

UNTIL = ("end", "snap", "decided")
ELEMENTS, TOLERANCE = 8, 3e-5


@checked
def simulate(
    scene: Scene,
    *,
    elements: int = ELEMENTS,
    extensible: bool = False,
    method: str | Tableau = "esdirk4",
    step: float | None = None,
    tolerance: float | None = None,
    spectral_radius: float | None = None,
    gyroscopic: bool = False,
    every: int | None = None,
    configurations: bool = True,
    until: str = "end",
    initial: RestState | History | None = None,
) -> History:
    """The motion from rest in the start state, through the ramp and the hold, or the schedule.

    Parameters
    ----------
    scene: with a `stop` or a `schedule`.
    elements: an even number of at least 4; errors fall as elements^-10.  They are done four at a
        time: 6 take nearly the time of 8, and 10 that of 12.
    extensible: whether the ribbon stretches, with EA of the scene's ribbon.
    method: "esdirk4", "esdirk3" (`ribbonfem.tableaus`), "tr-bdf2", "generalised-alpha", "newmark"
        (trapezoidal), "implicit-euler" or "discrete-gradient", of order 2, which alone keeps the
        energy of undamped ringing, whatever the step (`kernels.average_vector_field`): the one for a
        ring-down, with ``tolerance=1e-4``.  What another takes is in the history's `stats`.
        The others lose or gain it: velocities of their steps do not fit the constraint (an
        inextensible ribbon gains energy), and fast waves are damped.
    step: a fixed step in s, shortened so that a whole number of steps fits the ramp, and halved
        where no next state is found.
    tolerance: of the adaptive step, the local error of positions in L, made smaller while the
        ribbon creeps (down to 0.01 of it); 3e-5 if neither is given,
        which leaves 2e-6 rad in a snap's angle in the median of drawn scenes and 7e-5 at most, where the
        mesh leaves 1e-7 (`pytest -m slow -s -n 0 tests/test_defaults.py`).  A step in which the energy grows
        by a thousandth more than the work done is halved too.
    spectral_radius: of "generalised-alpha" at infinite frequency, in (0, 1]; 0.8.
    gyroscopic: whether the spin about the tangent turns with it, d(J theta' t)/dt; False is the
        balance of the rods and of the paper.
    every: keep the rows of each `every`-th accepted step, and the last; None keeps all up to 160 MB, and
        thins them out then (`History`).
    configurations: False leaves positions and directors out of the result.
    until: "end"; "snap", soon after the height first changes sign; "decided" ends a held ribbon's
        run once its energy is below that of every saddle that the curve of equilibria through
        its start has at `stop`.
    initial: a `RestState` to begin at in place of the scene's `start`, or a `History` whose last instant is
        gone on from: time goes on, and dissipated energy and work.  Of the same model, mesh and ribbon; its
        clamps have to be where the scene's begin.  To the last bit the uninterrupted run where that has a
        kink then.  What snaps is told by the equilibrium in which the motion begins, where it begins in one
        (`History.snap`).

    Returns
    -------
    History
        `configurations` holds "positions" (rows, nodes, 3) in L and "normals" (rows, nodes, 3),
        the directors m1, at the Gauss-Lobatto nodes, and "velocities" (rows, nodes, 3) in L/s, where they do
        not ring ("discrete-gradient").

    Raises
    ------
    SceneError
        For a scene without `stop`, or whose start is not a stable equilibrium.
    OptionError
        For an option that cannot be.
    SolverError
        If no step converges, or if the energy grows from nowhere; what was reached is its `history`.
    """
    control = Control.of(method, step, tolerance, until, spectral_radius, TOLERANCE, UNTIL, ALL_METHODS)
    control.require_elastic(method, scene)
    mesh = checked_mesh(elements, extensible)
    nodes = P * mesh["elements"] + 1 if configurations else 0
    row = 8.0 * (arrays.ROW_SIZE + 6 * nodes)
    require_duration(scene, control.step, LARGEST_TURN, row / every if every else 0.0)
    first: Callable[[], arrays.Motion] | None = None
    began, rest = 0.0, None
    if initial is None:
        problem, start = states.named(scene, **mesh)
    else:
        problem = states.in_control(scene, **mesh)
        start, first, began = initial_states.of(problem, scene, initial)
        rest = initial_states.rest_of(problem, start, scene, initial)
    barrier = _barrier(scene.at_rest, scene.require_stop(), **mesh) if until == "decided" else -np.inf
    ends = moving(scene, began=began) if began else None
    since = began + snaps_since(scene, until, "kirchhoff", mesh, rest) / problem.unit
    ramp = ramp_of(scene, control, ends=ends, since=since, every=every or 1, barrier=barrier)
    options = options_given(tolerance=control.tolerance)
    return integrate(problem, start, scene, control, ramp, options, configurations, first, initial, rest)


@lru_cache(maxsize=16)
def _barrier(scene: Scene, control: float, *, elements: int, extensible: bool) -> float:
    """Energy of the lowest saddle at a control; -inf if there is none: nothing is then decided early.

    Nor where a force acts at midspan, whose energy the loop does not know.
    """
    problem, state = states.named(scene, elements=elements, extensible=extensible)
    if scene.controls(control)["force"]:
        return -np.inf
    return lowest_saddle(problem, state, problem.potential, scene, control, steps_for(scene))
