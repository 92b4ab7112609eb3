"""The result of a motion, `History`: its snaps, crossings of a level, loss of stability; and `SolverError`.

Times are in s, lengths in L, angles in rad, energies in EI2/L, forces in EI2/L^2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

from .equilibria import Array, Controlled, Instability, axis_of, caption, name_and_unit, uniform
from .events import kinks_of, root
from .frozen import called_later, html_table, short_options, some_rows
from .scene import Scene, Schedule, as_number, shown

# options that say on which mesh, and of what, a result was computed
MESH = ("nodes", "clamp", "elements", "degree", "extensible")
# a quantity has left its level once it is this far from it: rounding is not
DEPARTED = 1e-6
# part of the largest kinetic energy that a method itself takes or gives, beyond which it is told
TOLD = 0.01
# where the functions of each model are
_MODELS = {name: f"ribbonfem.{name}" for name in ("quasilinear", "elastica", "kirchhoff")} | {"der": "der"}


class SolverError(RuntimeError):
    """A solve that did not converge.  Says what was tried and what to change.

    `history` holds what a time stepper had reached, or None.
    """

    def __init__(self, message: str, history: History | None = None) -> None:
        super().__init__(message)
        self.history = history


@dataclass(frozen=True, repr=False, eq=False)
class History(Controlled):
    """A motion, one row an accepted step, or some of those.

    What happens in it (`crossing`, `ribbonfem.outcomes`) is found in all steps, whichever have rows.
    `every` of `simulate` says which have: each `every`-th and the last.  By default all have, until they
    take 160 MB: then rows are left out that a line through those kept passes within 1e-3 L, or more where
    so few do not fit.

    Attributes
    ----------
    time: (rows,) s.
    control: (rows,) of the scene; `angle` is the same where only clamps are turned.
    height: (rows,) z(1/2)/L.
    slope: (rows,) z-component of the unit tangent at midspan.
    energies: "kinetic", "elastic", "potential" (of weight), "dissipated" (by damping and retardation) and
        "work" (of all controls), each (rows,), in EI2/L; kinetic + elastic + potential + dissipated - work is
        constant in an exact solution.
    configurations: "positions" (rows, nodes, 3) in L, "velocities" in L/s, and what else the model has.
    stats: steps, newton_iterations, rejected, seconds (of the solve alone);
        "numerical_dissipation", EI2/L, the energy that the method itself took, with the quadrature of the
        work and of the damping: what kinetic + elastic + dissipated - work has lost at the end (what it
        gave has the other sign), and "numerical_dissipation_share", that part of the largest kinetic
        energy.  `kirchhoff` with ``method="discrete-gradient"`` takes none: take it where a ribbon rings.
        "rows_within", where not `every` says which rows are kept, L: a line through them passes those
        left out within it; 0 if none is.
    scene, options, model: what it was made from.
    load: (rows,) compressive force along x times L^2/EI2, averaged along the ribbon (sigma^2 of the
        quasi-linear beam); NaN where the program that made the history does not say.
    arclength: (nodes,) s/L of the nodes of the configurations.
    velocity: (rows,) d(height)/d(time), L/s; at a kink of the clamp's motion that of the instant before.
        NaN where the program that made the history does not say, or has none that serves (velocities of
        undamped means ring from step to step).
    rest: the state at rest that is followed, as `instabilities_from` of the model takes it, where it did
        not begin at the scene's `start`; empty where there is none (`simulate(..., initial=)`).
    reactions: (rows, 2, 6) of the left and of the right clamp on the ribbon, in the fixed frame: force along
        x, y and z (EI2/L^2), moment about x, y and z at the clamp's own point (EI2/L).  The weight and the
        inertia of what a clamp holds are in them, so that both forces, the weight and the force at midspan,
        less nu times the momentum, are its rate.  0 across the plane of planar models; along x
        sigma^2 and -sigma^2 of `quasilinear`.  At a kink of the clamp's motion that of the instant before.
        The finite elements' "discrete-gradient" knows the force in the ribbon as the mean of each step
        alone, which rings.  NaN where the program that made the history does not say.
    steps: (5, steps) time, angle, height, slope and velocity of every step, from which what happens is
        found (beyond a million steps of those around it, and of some between); None where rows are those.
    resume: what the model's stepper goes on from at the last instant (`simulate(..., initial=)`); empty where
        it does not say.
    """

    time: Array
    control: Array
    height: Array
    slope: Array
    energies: Mapping[str, Array]
    configurations: Mapping[str, Array]
    stats: Mapping[str, float]
    scene: Scene
    options: Mapping[str, Any] = field(default_factory=dict)
    model: str = ""
    load: Array = None  # type: ignore[assignment]
    arclength: Array = None  # type: ignore[assignment]
    velocity: Array = None  # type: ignore[assignment]
    steps: Array | None = None
    resume: Mapping[str, Array] = field(default_factory=dict)
    reactions: Array = None  # type: ignore[assignment]
    rest: Mapping[str, Array] | None = None

    def __post_init__(self) -> None:
        for name, shape in (("load", ()), ("velocity", ()), ("reactions", (2, 6))):
            if getattr(self, name) is None:
                object.__setattr__(self, name, np.full((len(self.time), *shape), np.nan))
        if self.arclength is None:
            object.__setattr__(self, "arclength", uniform(self.configurations.get("positions")))
        super().__post_init__()

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        if not len(self):
            return f"History({self.model or 'any model'}, empty; {short_options(self.options)})"
        snap, leaves = self.snap, self.unstable_from
        name, unit = name_and_unit(self.scene)
        share = self.stats.get("numerical_dissipation_share", 0.0)
        lost = self.stats.get("numerical_dissipation", 0.0)
        return (
            f"History({self.model or 'any model'}, {len(self)} rows, {self.time[-1]:.4g} s, {name} "
            f"{self.control[0]:.4g} .. {self.control[-1]:.6g} {unit}, z(1/2) {self.height[0]:.4g} .. "
            f"{self.height[-1]:.4g} L;\n"
            + ("  no snap" if snap is None else f"  snap at {snap[1]:.6g} {unit}, {snap[0]:.6g} s")
            + (f"; its state at rest is lost at {leaves:.6g} {unit}" if leaves == leaves else "")
            + (
                f";\n  the method itself {'took' if lost > 0.0 else 'gave'} {abs(lost):.3g} EI2/L, "
                f"{abs(share):.0%} of the largest kinetic energy"
                if abs(share) > TOLD
                else ""
            )
            + f"; {short_options(self.options)})"
        )

    def plot(self, axes: Any = None, **options: Any) -> Any:
        """Draw it into axes of matplotlib, or new ones: see `ribbonfem.output.plots.motion`."""
        return called_later("ribbonfem.output.plots:motion", self, axes, **options)

    def to_pandas(self) -> Any:
        """As a `pandas.DataFrame`: see `ribbonfem.output.tables.motion_frame`."""
        return called_later("ribbonfem.output.tables:motion_frame", self)

    def to_xarray(self) -> Any:
        """As an `xarray.Dataset`: see `ribbonfem.output.tables.motion_dataset`."""
        return called_later("ribbonfem.output.tables:motion_dataset", self)

    def _repr_html_(self) -> str:
        columns = ("time (s)", axis_of(self.scene), "z(1/2)/L", "slope")
        rows = [
            [float(c[k]) for c in (self.time, self.control, self.height, self.slope)]
            for k in some_rows(len(self))
        ]
        return html_table(caption(self), columns, rows)

    @property
    def snap(self) -> tuple[float, float] | None:
        """Time (s) and control of the first passage of the mean height of both clamps that is a snap.

        That is one after the control has passed an instability of the state followed, found when this is
        read: opposed clamps take the height through 0 at rest.  Followed is the scene's `start`, or the
        equilibrium in which the motion begins (`initial`).  Where it begins in none (a state that is let go,
        a motion gone on from beyond its fold) every passage counts.
        """
        if self.scene is None or self.scene.usual or self.model not in _MODELS:
            return self.crossing()
        begin = self.snaps_from
        return None if begin == np.inf else self.crossing("height", after=begin)

    @property
    def snaps_from(self) -> float:
        """When the control first passes an instability of the state followed, s; infinite if never.

        Its beginning where no state at rest is followed.
        """
        scene = self.scene
        if scene is None or scene.usual or self.model not in _MODELS:
            return 0.0
        return self.begun + snaps_from(scene, self.model, self.options, self.rest)

    @property
    def begun(self) -> float:
        """When it began, s: of a motion gone on from, the last instant of that."""
        times = self.track[0]
        return float(times[0]) if len(times) else 0.0

    @property
    def unstable_from(self) -> float:
        """The control at which the state at rest is lost at a pitchfork or branch point, NaN if it is not.

        The first of the model's `instabilities` that is no fold, found when this is read, of the state
        followed: the scene's `start`, or the equilibrium in which it begins (`initial`).  Without an
        imperfection, which a preset is, the motion stays on the lost state beyond it.
        """
        lost = _lost(self)
        return lost.control if lost is not None else np.nan

    @property
    def leaves_plane(self) -> float:
        """`unstable_from`, where the state leaves its plane there; NaN elsewhere."""
        lost = _lost(self)
        return lost.control if lost is not None and lost.out_of_plane else np.nan

    @property
    def track(self) -> tuple[Array, Array, Array, Array, Array]:
        """Time, control, height, slope and velocity of every step, whichever have rows."""
        if self.steps is None:
            return self.time, self.control, self.height, self.slope, self.velocity
        time, control, height, slope, velocity = self.steps
        return time, control, height, slope, velocity

    def crossing(
        self, quantity: str = "height", level: float | None = None, *, after: float = 0.0
    ) -> tuple[float, float] | None:
        """Time and control at which "height" or "slope" first crosses `level`.

        The level of a height is by default the mean height of both clamps (0 where none is lifted).  Counted
        only once the quantity has been further than 1e-6 from the level: at rest it may
        lie on it, and rounding crosses it then.  Passages before the time `after` (s) do not count.
        Solved for on a polynomial through the steps, and
        the velocities, around the crossing (`events.root`), so that its error is of the
        integration and not of their grid, and the same whichever rows are kept.

        Returns
        -------
        (time, control), the first in s, or None if there is no crossing.

        Raises
        ------
        ValueError
            If `quantity` is not "height" or "slope", or `level` no finite number.

        Examples
        --------
        >>> from ribbonfem import Scene, elastica
        >>> beam = Scene(compression=0.40, shear=0.0, start="U+", rate=1.0, stop=1.5)
        >>> time, angle = elastica.simulate(beam).crossing("height")
        >>> round(time, 3), round(angle, 3)
        (1.307, 1.307)
        """
        if not isinstance(quantity, str) or quantity not in ("height", "slope"):
            raise ValueError(f"quantity = {shown(quantity)}: must be 'height' or 'slope'")
        try:
            above = 0.0 if level is None else as_number(level)
        except ValueError as error:
            raise ValueError(f"level = {shown(level)}: {error}") from None
        times, controls, height, slope, velocity = self.track
        values, rates = np.asarray(height if quantity == "height" else slope) - above, None
        if quantity == "height":
            rates = velocity
            if level is None and self.scene is not None:
                values = values - self.scene.clamps_height(controls)
                rates = None if self.scene.drives.lift else velocity
        departed = np.flatnonzero((np.abs(values) > DEPARTED) & (times >= after))
        if not departed.size:
            return None
        side = values[departed[0]] > 0.0
        beyond = np.flatnonzero((values[departed[0] :] <= 0.0) if side else (values[departed[0] :] >= 0.0))
        if not beyond.size:
            return None
        k = int(departed[0] + beyond[0])
        if values[k] == 0.0:
            return float(times[k]), float(controls[k])
        time = root(times, values, k, rates, self.kinks(times, controls))
        schedule = None if self.scene is None else self.scene.schedule
        if schedule is None:
            return time, float(np.interp(time, times, controls))
        return time, schedule(time - self.begun)

    def stands_still(self, time: float) -> bool:
        """Whether the control does not move about an instant (s), so that its value does not tell that."""
        times, controls = self.track[:2]
        k = min(max(int(np.searchsorted(times, time)), 1), len(times) - 1)
        return bool(controls[k - 1] == controls[k])

    def kinks(self, times: Array, controls: Array) -> tuple[int, ...]:
        """The rows of these at which the control's speed jumps."""
        if self.scene is None or self.scene.schedule is None:
            return kinks_of(controls)
        # (times of a run are sums of its steps)
        at = self.begun + np.array([0.0, *self.scene.schedule.kinks])
        rows = np.clip(np.searchsorted(times, at - 1e-9 * (1.0 + at)), 0, len(times) - 1)
        near = np.abs(times[rows] - at) <= 1e-9 * (1.0 + at)
        return tuple(int(row) for row in rows[near])


def _lost(history: History) -> Instability | None:
    """The instability at which a motion's state at rest is lost, if that is no fold."""
    if history.model not in _MODELS or history.scene is None:
        return None
    result = _before_end(history.scene, history.model, history.options, history.rest)
    return next((point for point in result if point.kind != "fold"), None)


def snaps_from(
    scene: Scene, model: str, options: Mapping[str, Any], rest: Mapping[str, Array] | None = None
) -> float:
    """When a scene's control first passes an instability of its state at rest, s; infinite if never.

    `rest` as in `History`: 0 where there is no state at rest.
    """
    if rest is not None and not rest:
        return 0.0
    first = [_before_end(side, model, options, rest)[:1] for side in _sides(scene)]
    return min((scene.passes(point.control) for points in first for point in points), default=np.inf)


def _sides(scene: Scene) -> tuple[Scene, ...]:
    """The scene, and, where its schedule goes to the other side of its beginning too, a ramp that way."""
    if scene.schedule is None:
        return (scene,)
    low, high = scene.schedule.extremes
    other = low if scene.direction > 0.0 else high
    if other == scene.begin:
        return (scene,)
    return scene, replace(scene, schedule=Schedule((0.0, 1.0), (scene.begin, other), "linear"))


def snaps_since(
    scene: Scene,
    until: str,
    model: str,
    options: Mapping[str, Any],
    rest: Mapping[str, Array] | None = None,
) -> float:
    """When a passage of the height begins to count as the snap that ends a run, s after its beginning.

    What is a snap is said by the states at rest, which are asked only where a snap is asked for.
    """
    return 0.0 if until != "snap" or scene.usual else snaps_from(scene, model, options, rest)


def instabilities_of(history: History) -> tuple[Instability, ...]:
    """Where the state at rest of a motion's scene is lost, however far it goes; () if that is not known."""
    if history.model not in _MODELS or history.scene is None:
        return ()
    return _met(history.scene, history.model, history.options, history.rest)


def _met(
    scene: Scene, model: str, options: Mapping[str, Any], rest: Mapping[str, Array] | None
) -> tuple[Instability, ...]:
    mesh = tuple((name, value) for name, value in options.items() if name in MESH)
    still, far = scene.at_rest, scene.furthest
    if scene.begin == 0.0:
        # (scenes share what is met, but for one that goes farther than it is looked for)
        still = replace(still, rate=scene.direction)
        if far is not None and scene.direction * far > still.reach_towards(scene.direction):
            still = replace(still, stop=far)
    # (bytes have a hash)
    state = rest and tuple((name, array.shape, array.tobytes()) for name, array in rest.items())
    return () if state == {} else _instabilities(model, still, mesh, state)


def _before_end(
    scene: Scene, model: str, options: Mapping[str, Any], rest: Mapping[str, Array] | None
) -> list[Instability]:
    far, sign = scene.furthest, scene.direction
    met = _met(scene, model, options, rest)
    return [point for point in met if far is None or sign * (point.control - far) <= 0.0]


@lru_cache(maxsize=1024)
def _instabilities(
    model: str,
    scene: Scene,
    mesh: tuple[tuple[str, Any], ...],
    rest: tuple[tuple[str, tuple[int, ...], bytes], ...] | None = None,
) -> tuple[Instability, ...]:
    try:
        if rest is not None:
            state = {name: np.frombuffer(data).reshape(shape).copy() for name, shape, data in rest}
            place = f"{_MODELS[model]}.functions:instabilities_from"
            return tuple(called_later(place, scene, state, **dict(mesh)))
        return tuple(called_later(f"{_MODELS[model]}:instabilities", scene, **dict(mesh)))
    except (SolverError, ValueError, AttributeError):
        # of a state that cannot be followed nothing is said
        return ()
