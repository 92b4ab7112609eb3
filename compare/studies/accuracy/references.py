"""Reference values of the accuracy study, and how each was verified by another method or model.

At rest: the closed forms, and for each discretisation another that shares no mechanics with it.
In motion: the beams against the limit of fixed Newmark steps on a fine mesh, a method that shares
no stages with the default one; the planar rods against that of the extensible elastica; the
ribbons against finite elements on a mesh and with a tolerance where little is left, with the limit
of the rods' meshes as the other witness, which shares no mechanics with them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare.limits import Limit, richardson
from compare.quantities.measure import Rest, Shape, at_rest, fold_angles, run
from ribbonfem import Scene, kirchhoff, quasilinear
from ribbonfem.closed_form import euler
from ribbonfem.results import Array

from .cases import Bench, Family, observed

# meshes of the solutions that count as exact at rest; below DIGITS lies rounding
_FINE = {"elastica": 48, "kirchhoff": 48}
DIGITS = 1e-12
_RODS_AT_REST = (101, 201, 401)
_RODS_IN_MOTION = (51, 101, 201)
_BEAM_ELEMENTS = {"elastica": 12, "quasilinear": 64}
# the tolerance of the rods' limits; explicit steps (s) on this mesh share no solver with the implicit ones
_TIGHT = 1e-6
# rad; snap angles of independent methods that agree so far confirm each other
_CLOSE = 5e-6
# elements and tolerance of a ribbon's reference
_ELEMENTS_IN_MOTION = (10, 1e-7)
_EXPLICIT = {"nodes": 51, "method": "verlet", "step": 8e-6}


@dataclass(frozen=True)
class Reference:
    """Values that errors are taken against.

    Attributes
    ----------
    values: by quantity; uncertainty: of each, in its unit.
    source: where they are from, in words.
    verified: whether what should confirm them does.
    checks: differences of the angle from other solutions (rad), by what they are.
    """

    values: Mapping[str, Any]
    uncertainty: Mapping[str, float]
    source: str
    verified: bool
    checks: Mapping[str, float]

    def record(self) -> dict[str, Any]:
        """The same for programs, without the shapes."""
        plain = {k: np.asarray(v).tolist() for k, v in self.values.items() if not isinstance(v, Shape)}
        return {
            "values": plain,
            "uncertainty": dict(self.uncertainty),
            "source": self.source,
            "verified": self.verified,
            "checks": dict(self.checks),
        }


def _worst(a: Any, b: Any) -> float:
    return float(np.max(np.abs(np.subtract(a, b))))


def buckled(scene: Scene) -> Rest:
    """The inextensible buckled beam at alpha = 0 in elliptic functions: shape, energy, height."""
    s = np.linspace(0.0, 1.0, 385)
    x, z = euler.shape(scene.compression, s)
    side = 1.0 if scene.start == "U+" else -1.0
    shape = Shape(s, np.column_stack((x, np.zeros_like(x), side * z)))
    return Rest(shape, euler.energy(scene.compression), side * float(z[192]))


def small_slopes(scene: Scene) -> Rest:
    """The same of the quasi-linear beam: z = sqrt(dL) (1 - cos 2 pi s) / pi."""
    s, dl = np.linspace(0.0, 1.0, 385), scene.compression
    side = 1.0 if scene.start == "U+" else -1.0
    x = s - dl * (s - np.sin(4.0 * np.pi * s) / (4.0 * np.pi))
    z = side * np.sqrt(dl) * (1.0 - np.cos(2.0 * np.pi * s)) / np.pi
    return Rest(Shape(s, np.column_stack((x, np.zeros_like(s), z))), 4.0 * np.pi**2 * dl, float(z[192]))


def _fine(model: str, scene: Scene, extensible: bool) -> tuple[Array, Rest]:
    """Folds and rest state of finite elements on a mesh where little but rounding is left."""
    options: dict[str, Any] = {"elements": _FINE[model], "extensible": extensible}
    folds, rest = fold_angles(model, scene, options)[0], at_rest(model, scene, options)
    if model == "kirchhoff":
        # all its nodes: a spline through few of them would be less exact than they are
        state = kirchhoff.state(scene, **options)
        rest = Rest(Shape(state.s, state.positions), rest.energy, rest.height)
    return folds, rest


def _rod_limit(scene: Scene) -> Limit:
    angles = [fold_angles("der", scene, {"nodes": n})[0] for n in _RODS_AT_REST]
    return richardson(angles, [1.0 / (n - 2) for n in _RODS_AT_REST], 2.0)


def _elements_limit(scene: Scene, extensible: bool) -> Limit:
    meshes = (12, 16, 24)
    angles = [fold_angles("kirchhoff", scene, {"elements": n, "extensible": extensible})[0] for n in meshes]
    return richardson(angles, [1.0 / n for n in meshes], 10.0)


def _at_rest(case: Bench, family: Family) -> Reference:
    scene, extensible = case.scene, bool(family.extensible)
    if family.model == "quasilinear":
        angle = quasilinear.closed_form_fold().mu * scene.compression**0.5
        rest, source = small_slopes(scene), "closed form"
        values: dict[str, Any] = {"fold": np.array([angle]), "shape": rest.shape, "energy": rest.energy}
        return Reference(values, {"fold": DIGITS, "shape": DIGITS, "energy": DIGITS}, source, True, {})
    checks: dict[str, float] = {}
    if scene.planar:
        other = "kirchhoff" if family.model == "elastica" else "elastica"
        folds, rest = _fine(other, scene, extensible)
        twin = _fine("elastica" if other == "kirchhoff" else "kirchhoff", scene, extensible)
        uncertainty = {
            "fold": _worst(folds, twin[0]),
            "shape": rest.shape.distance(twin[1].shape),
            "energy": abs(rest.energy - twin[1].energy),
        }
        checks["elastica - Kirchhoff"] = uncertainty["fold"]
        source = f"{_FINE[other]} {other} elements"
        verified = uncertainty["fold"] < 1e-9
        if not extensible:
            rest = buckled(scene)
            uncertainty["shape"] = uncertainty["energy"] = DIGITS
    else:
        folds, rest = _fine("kirchhoff", scene, extensible)
        limit = _elements_limit(scene, extensible)
        uncertainty = {"fold": _worst(folds, limit.value)}
        uncertainty["shape"] = uncertainty["energy"] = 1e-11
        checks["limit, 12 to 24 elements"] = uncertainty["fold"]
        source, verified = f"{_FINE['kirchhoff']} elements", limit.verified
    if extensible:
        limit = _rod_limit(scene)
        checks["rods' limit"] = _worst(folds, limit.value)
        verified = verified and limit.verified and checks["rods' limit"] < 1e-6
    values = {"fold": folds, "shape": rest.shape, "energy": rest.energy}
    return Reference(values, {k: max(v, DIGITS) for k, v in uncertainty.items()}, source, verified, checks)


def _limits(
    result: Sequence[Mapping[str, Any]], sizes: Sequence[float]
) -> tuple[dict[str, Any], dict[str, Limit]]:
    """Second-order limits of snap, shape and energy of runs of falling size."""
    points = result[0]["shape"].s
    points = points[(points > -1e-12) & (points < 1.0 + 1e-12)]
    rows = {
        "snap": [f["snap"] for f in result],
        "energy": [f["energy"] for f in result],
        # on the same mesh these are the nodes themselves
        "shape": [
            f["shape"].r if len(f["shape"].s) == len(points) else f["shape"].at(points) for f in result
        ],
    }
    limits = {name: richardson(values, sizes, 2.0) for name, values in rows.items()}
    values: dict[str, Any] = {name: limit.value for name, limit in limits.items()}
    values["shape"] = Shape(points, np.asarray(values["shape"]))
    values["balance"] = 0.0
    return values, limits


def _beam_limit(case: Bench, family: Family) -> tuple[dict[str, Any], dict[str, Limit]]:
    """The limit of fixed Newmark steps on a fine mesh."""
    options = {**family.fixed, "elements": _BEAM_ELEMENTS[family.model], "method": "newmark", "until": "snap"}
    # the quasi-linear beam carries the kink of the ramp on as waves of all lengths
    finest = 0.5 * case.step if family.model == "quasilinear" else case.step
    steps = [4.0 * finest, 2.0 * finest, finest]
    runs = [run(family.model, case.scene, {**options, "step": step})[0] for step in steps]
    return _limits([observed(history, family.model, case.look) for history in runs], steps)


def _rods_limit(case: Bench, tolerance: float) -> tuple[dict[str, Any], dict[str, Limit]]:
    """The limit of the rods' meshes."""
    runs = [
        run("der", case.scene, {"nodes": nodes, "tolerance": tolerance, "until": "snap"})[0]
        for nodes in _RODS_IN_MOTION
    ]
    sizes = [1.0 / (nodes - 2) for nodes in _RODS_IN_MOTION]
    return _limits([observed(history, "der", case.look) for history in runs], sizes)


def _elements_limit_in_motion(case: Bench) -> tuple[dict[str, Any], dict[str, float]]:
    """A ribbon's motion by elements, on a mesh and with a tolerance where little is left, and what is."""

    def result(elements: int, tolerance: float) -> dict[str, Any]:
        options = {"elements": elements, "tolerance": tolerance, "extensible": True, "until": "snap"}
        return dict(observed(run("kirchhoff", case.scene, options)[0], "kirchhoff", case.look))

    fine, tight = _ELEMENTS_IN_MOTION
    best = result(fine, tight)
    others = (result(fine - 2, tight), result(fine, 10.0 * tight))
    uncertainty = {
        name: sum(abs(other[name] - best[name]) for other in others) for name in ("snap", "energy")
    }
    uncertainty["shape"] = sum(other["shape"].distance(best["shape"]) for other in others)
    return {**best, "balance": 0.0}, uncertainty


def _snap(case: Bench, options: Mapping[str, Any]) -> float:
    history, _ = run("der", case.scene, {**options, "until": "snap", "configurations": False})
    result = history.crossing()
    return float("nan") if result is None else result[1]


def _in_motion(case: Bench, family: Family) -> Reference:
    checks: dict[str, float] = {}
    if not case.scene.planar:
        rods, limits = _rods_limit(case, _TIGHT)
        explicit = _snap(case, {**_EXPLICIT, "every": 4})
        implicit = _snap(case, {"nodes": _EXPLICIT["nodes"], "tolerance": _TIGHT})
        checks[f"explicit, {_EXPLICIT['nodes']} nodes"] = abs(explicit - implicit)
        values, uncertainty = _elements_limit_in_motion(case)
        source = f"{_ELEMENTS_IN_MOTION[0]} elements at {_ELEMENTS_IN_MOTION[1]:g}"
        # the other witness: what the limit of the rods may miss, and is left of the time step on one mesh
        checks["rods' limit"] = abs(rods["snap"] - values["snap"])
        allowed = uncertainty["snap"] + limits["snap"].uncertainty + abs(explicit - implicit) + _CLOSE
        verified = limits["snap"].verified and checks["rods' limit"] <= allowed
    else:
        beam = (
            Family("elastica-EA", "elastica", (), {"extensible": True}) if family.model == "der" else family
        )
        values, limits = _beam_limit(case, beam)
        source = f"Newmark limit, {_BEAM_ELEMENTS[beam.model]} elements"
        uncertainty = {name: limit.uncertainty for name, limit in limits.items()}
        options = {"elements": _BEAM_ELEMENTS[beam.model], "tolerance": 1e-7, "until": "snap"}
        crossing = run(beam.model, case.scene, {**beam.fixed, **options})[0].crossing()
        checks["ESDIRK4 at 1e-7"] = abs((crossing or (0.0, np.nan))[1] - values["snap"])
        # by its order, or, after a fast ramp's kink, by the other method
        verified = limits["snap"].verified or checks["ESDIRK4 at 1e-7"] < _CLOSE
        if beam.extensible:
            rods, rod_limits = _rods_limit(case, _TIGHT)
            checks["rods' limit"] = abs(rods["snap"] - values["snap"])
            verified = verified and rod_limits["snap"].verified and checks["rods' limit"] < _CLOSE
    uncertainty["balance"] = DIGITS
    return Reference(values, {k: max(v, DIGITS) for k, v in uncertainty.items()}, source, verified, checks)


def kind_of(case: Bench, family: Family) -> str:
    """What has the same reference in a case: the model, or the theory where another model gives it."""
    if case.dynamic:
        if not case.scene.planar:
            return "ribbon"
        return {None: "quasi-linear", True: "extensible", False: "inextensible"}[family.extensible]
    return family.name


def reference(case: Bench, family: Family) -> Reference:
    """The reference of a family in a case, computed anew.

    Raises
    ------
    SolverError
        From the runs.
    """
    return _in_motion(case, family) if case.dynamic else _at_rest(case, family)
