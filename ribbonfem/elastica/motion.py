"""`simulate` and `escape` of the elastica: from a scene to arrays of the time loop, `kernels/loop.py`."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ribbonfem.continuation import equilibrium
from ribbonfem.continuation.vibration import lowest_squares
from ribbonfem.delay import scene_departure
from ribbonfem.delay.departure import ESCAPE_UNTIL
from ribbonfem.elements.lobatto import lobatto_points
from ribbonfem.jit.groups import groups_of, in_fours
from ribbonfem.jit.simd import WIDTH
from ribbonfem.material.kernels import LAW
from ribbonfem.options import checked, options_given, refuse
from ribbonfem.results import Array, History, RestState, snaps_since
from ribbonfem.scene import Scene
from ribbonfem.stepping.control import Control
from ribbonfem.stepping.kernels import KINK, MEAN, Ramp, Scheme
from ribbonfem.stepping.kernels.arrays import TIME
from ribbonfem.stepping.methods import ALL_METHODS
from ribbonfem.stepping.newmark import Held, integrate
from ribbonfem.tableaus import Tableau

from . import initials, states
from .kernels import arrays, condensed, loop, tangent
from .kernels import average_vector_field as means
from .kernels.beam import PHI, ROWS, Beam, P, Z, solver
from .problem import Statics, _State, mesh_of

# 1/t*^2; the lowest frequencies squared are some hundreds
SHIFT = 100.0
ELEMENTS, TOLERANCE = 8, 3e-5


@lru_cache(maxsize=32)
def _constants(elements: int) -> dict[str, Array]:
    """What a beam has of its mesh alone; kept."""
    mesh = mesh_of(elements)
    inside = mesh.coupling[:, 1:P]
    real = np.zeros(WIDTH * groups_of(elements))
    real[:elements] = 1.0
    points, powers = lobatto_points(P)[:, None], np.arange(P + 1)
    by_powers = powers * points ** np.maximum(powers - 1, 0)
    # a node between two elements is in a state twice
    halves = mesh.middle.copy()
    if elements % 2 == 0:
        left = elements // 2 - 1
        halves[left, P] = halves[left + 1, 0] = 0.5
    middle = _once(halves)
    return {
        "value": mesh.tables.value,
        "weights": mesh.weights,
        "coupling": mesh.coupling,
        "bending": mesh.bending,
        "share": (inside / mesh.lumps[1:P]) @ inside.T,
        "mass": mesh.lumps,
        "light": 1.0 / mesh.lumps,
        "inside": mesh.coupling / mesh.lumps,
        "slopes": elements * by_powers @ np.linalg.inv(points**powers),
        "real": real.reshape(-1, WIDTH),
        "middle": middle,
        "push": np.ascontiguousarray(middle / mesh.lumps[:, None]),
    }


def discretised(problem: Statics) -> Beam:
    """The beam as arrays for the compiled time loop."""
    natural = in_fours(problem.rig.curvature[:, :, None])
    return Beam(
        **_constants(problem.elements),
        weight=problem.rig.weight,
        chord=problem.chord,
        elements=problem.elements,
        natural=natural,
        offset=np.concatenate((natural, np.zeros_like(natural)), axis=2),
        stiffness=np.ones(1),
        compliance=np.array([problem.compliance]),
        elastic=np.array([1.0, problem.compliance]),
        retardation=problem.scene.ribbon.retardation / problem.unit,
    )


def _once(table: Array) -> Array:
    """`in_fours`, with nothing where there is no element."""
    whole = in_fours(table)
    whole[-1, ..., (len(table) - 1) % WIDTH + 1 :] = 0.0
    return whole


class Motion:
    """A beam in motion, as `stepping.newmark` runs it.

    `begin` has its state by the names of `arrays.Motion`, and of what the beam counts strains from; what it
    has not is at rest.
    """

    def __init__(self, problem: Statics, begin: dict[str, Array], scheme: Scheme, rows: int) -> None:
        elements, groups = problem.elements, groups_of(problem.elements)
        beam = discretised(problem)
        retards = beam.retardation > 0.0
        clock = np.zeros(arrays.CLOCK_SIZE)
        clock[KINK] = 1.0
        state = {
            "v": np.zeros((groups, PHI, WIDTH)),
            "a": np.zeros((groups, PHI, WIDTH)),
            "auxiliary": np.zeros((groups, PHI, WIDTH)),
            "turning": np.zeros((groups, P + 1, WIDTH)),
            "strain": arrays.strains(elements, retards),
            "strain_rate": arrays.strains(elements, retards),
            "clock": clock,
        } | begin
        for name in LAW:
            getattr(beam, name)[:] = state.pop(name, getattr(beam, name))
        motion = arrays.Motion(**{name: value.copy() for name, value in state.items()})
        self.clock, self.scheme = motion.clock, scheme
        nodes, past = len(problem.arclength), means.KEPT if scheme.kind == MEAN else 0
        self._rows = np.empty((rows, nodes, 3)), np.empty((rows, nodes)), np.empty(rows)
        self.model = arrays.Moving(
            beam,
            solver(elements),
            arrays.scratch(elements, scheme.stages, retards, past),
            motion,
            *self._rows,
        )

    def kept(self) -> dict[str, Array]:
        """What it goes on from."""
        law = {name: getattr(self.model.beam, name).copy() for name in LAW}
        return {name: value.copy() for name, value in self.model.motion._asdict().items()} | law

    def observed(self, count: int) -> tuple[Array, Array, Array]:
        """Slopes (rows,), positions (rows, nodes, 3) and curvatures (rows, nodes) of the last rows."""
        positions, curvature, slope = self._rows
        return slope[:count], positions[:count], curvature[:count]

    def run(self, ramp: Ramp, rows: Array) -> int:
        """Go on until the end, or until the rows are full."""
        run = loop.run_by_means if self.scheme.kind == MEAN else loop.run
        return int(run(self.model, self.scheme, ramp, self.clock, rows))


def vibrations(problem: Statics, state: _State, count: int) -> Array:
    """The lowest `count` angular frequencies (count,), 1/s, of small undamped motions about a state at rest.

    Of the equations of motion: in a stretching beam the force does not stay constant along it.
    """
    beam, u, elements = discretised(problem), initials.at_rest(problem, state), problem.elements
    memory = solver(elements)
    tangent.fill(beam, memory, u, SHIFT, False)
    condensed.factorise(memory)
    # where a state has each inner node, once
    places = np.arange(u.size).reshape(u.shape)
    by_element = np.moveaxis(places, 2, 1).reshape(-1, ROWS)[:elements]
    along = np.column_stack([by_element[:, c : c + P].ravel()[1:] for c in (0, Z)])
    inertia = np.repeat(problem.mass[1:-1], 2)

    def solve(right: Array) -> Array:
        memory.rest[:] = 0.0
        memory.rest.flat[along.ravel()] = -right
        condensed.solve(beam, memory, SHIFT)
        return np.asarray(memory.rest.flat[along.ravel()])

    squares = lowest_squares(solve, lambda x: inertia * x, len(inertia), count, SHIFT)
    return np.asarray(np.sqrt(squares) / problem.unit)


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
    every: int | None = None,
    configurations: bool = True,
    until: str = "end",
    initial: RestState | History | None = None,
) -> History:
    """The motion from rest in the start state, through the ramp and the hold.

    Parameters
    ----------
    scene: a planar scene with a `stop` or a `schedule`.
    elements: of degree 5, at least 4; errors fall as elements^-10.
    extensible: whether the beam stretches, with EA of the rectangular section.
    method: "esdirk4", "esdirk3" (`ribbonfem.tableaus`), "tr-bdf2", "generalised-alpha", "newmark"
        (trapezoidal), "implicit-euler" or "discrete-gradient", of order 2, which alone keeps the energy of
        undamped ringing, whatever the step (`kernels.average_vector_field`): the one for a ring-down, with
        ``tolerance=1e-4``.
    step: a fixed step in s, shortened so that a whole number of steps fits the ramp, and halved
        where no next state is found.
    tolerance: of the adaptive step, the local error of positions in L, made smaller while the
        beam creeps (down to 0.01 of it); 3e-5 if neither is given,
        which leaves 3e-6 rad in a snap's angle in the median of drawn scenes and 7e-5 at most, where the
        mesh leaves 1e-8 and 2e-5 (`pytest -m slow -s -n 0 tests/test_defaults.py`).
    spectral_radius: of "generalised-alpha" at infinite frequency, in (0, 1]; 0.8.
    every: keep the rows of each `every`-th accepted step, and the last; None keeps all up to 160 MB, and
        thins them out then (`History`).
    configurations: False leaves positions and curvatures out of the result.
    until: "end", or "snap", soon after the height first changes sign.
    initial: a `RestState` to begin at in place of the scene's `start`, or a `History` whose last instant is
        gone on from: time goes on, and dissipated energy and work.  Of the same mesh and ribbon, the state of
        any model with these nodes; its clamps have to be where the scene's begin.  To the last bit the
        uninterrupted run where that has a kink then.

    Returns
    -------
    `History`, with the nodes' "positions" (rows, nodes, 3) in L and "curvature" (rows, nodes) in 1/L as
        configurations.

    Raises
    ------
    SceneError, OptionError
        For a scene that is not planar, one without `stop`, options that cannot be.
    SolverError
        If no step converges; what was reached is its `history`.
    """
    control = Control.of(method, step, tolerance, until, spectral_radius, TOLERANCE, methods=ALL_METHODS)
    scene.require_stop()
    if control.method.mean and scene.ribbon.retardation > 0.0:
        refuse("method", method, "is of elastic moments alone, and Ribbon.retardation is not 0")
    if initial is None:
        problem, start = states.named(scene, elements, extensible)
        begin = {"u": initials.at_rest(problem, equilibrium(problem, start, scene.begin)[0])}
        began = 0.0
    else:
        problem = Statics(scene, elements, extensible)
        begin = initials.of(problem, scene, initial)
        began = float(begin["clock"][TIME]) if "clock" in begin else 0.0
    mesh = {"elements": elements, "extensible": extensible}
    since = began + snaps_since(scene, until, "elastica", mesh) / problem.unit
    moved = integrate(
        "elastica",
        lambda scheme, rows: Motion(problem, begin, scheme, rows),
        scene,
        control,
        len(problem.arclength),
        every=every,
        since=since,
        began=began,
        configurations=configurations,
    )
    options = options_given(tolerance=control.tolerance)
    return moved.as_history(scene, options, model="elastica", arclength=problem.arclength, initial=initial)


@checked
def escape(
    scene: Scene,
    *,
    fold: int = 0,
    amplitude: float = 3e-3,
    elements: int = ELEMENTS,
    extensible: bool = False,
    tolerance: float = 1e-6,
    until: str = "end",
) -> History:
    """The motion that leaves a fold at the fold's own angle, the clamp held there.

    It starts displaced along the fold's null vector, all else in equilibrium, with the velocity of
    the unstable solution of the normal form; the scene says the start, the direction and the damping.

    Parameters
    ----------
    fold: which of the `folds` of a ramp, from 0.
    amplitude: of the null vector, in L with the whole beam of mass 1, of [1e-5, 0.05].
    tolerance: of the adaptive step, the local error of positions in L.
    elements, extensible: as in `simulate`.
    until: "end"; "snap", soon after the height first changes sign; "normal form", when that has left
        to infinity.

    Raises
    ------
    OptionError, SolverError
        For a fold that is not met, an amplitude or options that cannot be; as in `simulate`.
    """
    control = Control.of("esdirk4", None, tolerance, until, None, TOLERANCE, ESCAPE_UNTIL)
    problem, start = states.named(scene, elements, extensible)
    result, duration = scene_departure(problem, start, scene, fold, amplitude, until=until)
    velocity = problem.moving(result.state, result.velocity)
    # the right clamp, to the last digit
    velocity[-1] = 0.0
    begin = {"u": initials.at_rest(problem, result.state), "v": initials.in_rows(problem, velocity)}
    moved = integrate(
        "elastica",
        lambda scheme, rows: Motion(problem, begin, scheme, rows),
        scene,
        control,
        len(problem.arclength),
        held=Held(result.form.angle, duration),
    )
    return moved.as_history(scene, options_given(), model="elastica", arclength=problem.arclength)
