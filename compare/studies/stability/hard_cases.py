"""The list of hard cases in motion: scenes that broke a method, or were made to; classes of their verdicts.

Sheared ribbons are for the rods and the Kirchhoff elements, planar ones for the beams too.  Angles
and periods that a case is built on (the fold and the lowest period of its own mesh, 51 nodes) are
printed by `der.folds` and follow from the lowest eigenvalue at the start.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, fields
from typing import Any

from ribbonfem import Ribbon, Scene, SceneError
from ribbonfem.options import OptionError

RODS, KIRCHHOFF, ELASTICA, QUASILINEAR = "DER", "Kirchhoff", "elastica", "quasi-linear"
PATH_1: dict[str, Any] = {"compression": 0.40, "shear": 0.37, "start": "U+S-"}
UNBROKEN: dict[str, Any] = {"compression": 0.40, "shear": 0.37, "start": "U+"}
PLANAR: dict[str, Any] = {"compression": 0.40, "shear": 0.0, "start": "U+"}

# the paper's ratios, written: they stand, whatever the section
_PAPER: dict[str, Any] = {"bending_ratio": 400.0, "twist_ratio": 1.4562}
# ratios that follow from the section: 4e4 and 1.499
# there is no weight in these cases, heavy as some of the ribbons are
WEIGHTLESS = (0.0, 0.0, 0.0)
THIN = Ribbon(thickness=1e-3)
# written, to be hard for its stretch alone: EA L^2/EI2 = 1.2e9; 4e6 would follow
THINNEST = Ribbon(thickness=1e-4, **_PAPER)
# of 20 : 1, so that the paper's follow
STEEL = Ribbon(length=0.05, width=0.01, thickness=5e-4, young=2e11, density=7800.0)
RUBBER = Ribbon(length=10.0, width=2.0, thickness=0.1, young=1e6, density=1000.0)
SILICON = Ribbon(length=3e-4, width=6e-5, thickness=3e-6, young=2e11, density=2000.0)

# of 51 nodes: the fold that U+S- and the planar U+ meet (rad), the lowest period at their start (s)
FOLD, PLANAR_FOLD = 0.567914505841, 1.124963285282
PERIOD, PLANAR_PERIOD = 0.34891935, 0.18664906


@dataclass(frozen=True)
class Hard:
    """A hard case.

    Attributes
    ----------
    name, scene: what happens.
    step: of the methods with a fixed step, s.
    nodes: of the rods.
    snap: "height" or "slope", whose first zero is the instant that runs are judged by; or "", if
        there is none before the motion ends: then by the height throughout.
    refused: pairs: a model for which there is no such motion, and why: an error is its right answer,
        a refusal (`is_refusal`) the best one.
    """

    name: str
    scene: Scene
    step: float = 1e-3
    nodes: int = 51
    snap: str = "height"
    refused: tuple[tuple[str, str], ...] = ()

    @property
    def kink(self) -> float:
        """The instant at which the clamp stops, s."""
        return self.scene.require_stop() / self.scene.rate

    @property
    def duration(self) -> float:
        """Seconds of the ramp and the hold."""
        return self.kink + self.scene.hold


GOOD, LOSSY, UNBALANCED, COARSE, UNRESOLVED, RAISED, REFUSED, WRONG, SKIPPED = STATUSES = (
    "good",
    "loses energy",
    "unbalanced",
    "coarse mesh",
    "unresolved",
    "raised",
    "refused",
    "WRONG",
    "skipped",
)


@dataclass(frozen=True)
class MotionVerdict:
    """How a method did on a case.

    Attributes
    ----------
    drift: largest gain (or, negative, loss) of energy beyond the balance, over the largest kinetic energy.
    error, unit: against the reference: of the snap's instant, in "rad" of the clamp on the ramp or as
        part of the "wait" since it stopped; of the height, in "L", where there is no snap.
    mesh: of default runs: the same against a mesh twice as fine, None if it says another outcome.
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
    mesh: float | None = None
    snap: float | None = None
    rejected: int | None = None
    seconds: float | None = None


_FIELDS = "|".join([item.name for kind in (Scene, Ribbon) for item in fields(kind)] + list(_PAPER))


def is_refusal(error: Exception) -> bool:
    """Whether an error is an answer: of the scene or the configuration, with the field's name and value.

    Anything else that is raised may be as readable, but it was met on the way and not foreseen.
    """
    if isinstance(error, SceneError):
        return re.match(rf"(Scene\.|Ribbon\.)?({_FIELDS}) = ", str(error)) is not None
    return isinstance(error, OptionError) and re.match(r"\w+ = ", str(error)) is not None


def message_of(error: Exception) -> str:
    """What an error says, on one line; with its type, if it is none of this package's own."""
    own = type(error).__module__.partition(".")[0] in ("ribbonfem", "der")
    text = " ".join(str(error).split())
    return text if own else f"{type(error).__name__}: {text}"


def _path_1(name: str, step: float = 1e-3, nodes: int = 51, snap: str = "height", **scene: Any) -> Hard:
    """A case on the paper's Path 1; rate 0.5 to 0.8 rad at nu = 1 if not told otherwise."""
    given = {"rate": 0.5, "stop": 0.8, "damping": 1.0, "gravity": WEIGHTLESS, **PATH_1, **scene}
    return Hard(name, Scene(**given), step, nodes, snap)


def _planar(
    name: str, step: float = 1e-3, snap: str = "height", refused: dict[str, str] | None = None, **scene: Any
) -> Hard:
    """A planar case; rate 0.5 to 1.4 rad at nu = 1 if not told otherwise."""
    given = {"rate": 0.5, "stop": 1.4, "damping": 1.0, "gravity": WEIGHTLESS, **PLANAR, **scene}
    return Hard(name, Scene(**given), step, snap=snap, refused=tuple((refused or {}).items()))


# those that broke something in prototypes
KNOWN = (
    _path_1("free ringing", rate=1.0, stop=0.6, damping=0.0, hold=10.0),
    _path_1("free ringing, step 1e-2", 1e-2, rate=1.0, stop=0.6, damping=0.0, hold=10.0),
    _path_1("thin, h/L 1e-3", 1e-2, rate=1.0, damping=0.1, ribbon=THIN, snap=""),
    _path_1("nu 10, step 0.1 s", 0.1, rate=0.01, damping=10.0),
    _path_1("nu 10, step 5 s", 5.0, rate=0.01, damping=10.0),
    _path_1("rate 100", rate=100.0, hold=1.0),
    _path_1("rate 1000", rate=1000.0, hold=1.0),
    _path_1("nu 1e3", 0.1, rate=1e-3, damping=1e3),
    _path_1("nu 1e5", 50.0, rate=1e-4, stop=2.5, damping=1e5),
    _path_1("7 nodes", stop=0.9, nodes=7, snap=""),
    _path_1("11 nodes", stop=0.9, nodes=11),
    _path_1("alpha to 3.5", rate=1.0, stop=3.5),
    _path_1("alpha to 2 pi", rate=1.0, stop=2 * math.pi),
    _path_1("alpha to -1", rate=-1.0, stop=-1.0, snap="slope"),
    Hard("dL 0.9", Scene(compression=0.9, shear=0.2, start="U+", rate=1.0, stop=1.0, damping=1.0), snap=""),
    _planar("planar ringing", rate=1.0, stop=1.5, damping=0.0, hold=1.0),
    _planar("planar, nu 1e5", 10.0, rate=1e-4, stop=2.5, damping=1e5),
    _planar("planar, full turn", rate=1.0, stop=2 * math.pi),
)

SIZES = (
    _path_1("rubber, 10 m", 0.1, rate=1e-3, damping=0.01, ribbon=RUBBER),
    _path_1("silicon, 0.3 mm", 1e-8, rate=1e4, damping=1e4, ribbon=SILICON),
    _path_1("h/L 1e-4", 0.1, rate=0.005, damping=0.01, ribbon=THINNEST),
    # written: 0.16, which would follow, has neither this start nor a stable planar state
    _path_1("h/L 0.05, W < h", ribbon=Ribbon(thickness=0.05, width=0.02, **_PAPER)),
)

RATIOS = (
    _path_1("EI1/EI2 1", **UNBROKEN, ribbon=Ribbon(bending_ratio=1.0)),
    _path_1("EI1/EI2 1.5, dW 1e-6", stop=1.4, **{**PLANAR, "shear": 1e-6}, ribbon=Ribbon(bending_ratio=1.5)),
    _path_1("EI1/EI2 1e4", ribbon=Ribbon(bending_ratio=1e4)),
    _path_1(
        "EI1/EI2 1e4, h/L 1e-4",
        0.1,
        rate=5e-3,
        damping=0.01,
        ribbon=Ribbon(thickness=1e-4, bending_ratio=1e4, twist_ratio=1.4562),
    ),
    _path_1("GJ/EI2 100", **UNBROKEN, ribbon=Ribbon(twist_ratio=100.0)),
)

SHEARS = (
    _path_1("dW 1e-6", stop=1.4, **{**PLANAR, "shear": 1e-6}),
    _path_1("dW 1e-3", stop=1.4, **{**PLANAR, "shear": 1e-3}),
    _path_1("below the pitchfork of U", stop=1.0, shear=0.330, start="U+"),
    _path_1("above the pitchfork, U+S+", stop=1.0, shear=0.335, start="U+S+"),
    _path_1("past it, S+", stop=1.5, shear=0.495, start="S+", snap="slope"),
    _path_1("U+ stable again", stop=1.2, shear=0.575, start="U+"),
    _path_1("nearly taut, dW 0.799", stop=1.5, shear=0.799, start="S+", snap=""),
    _path_1("dL 0.001", rate=0.05, stop=0.15, compression=0.001, shear=0.02, start="S+", snap="slope"),
    _path_1("dL 0.95", stop=1.0, compression=0.95, shear=0.3, start="U+S+"),
)

STEPS = (
    _path_1("alpha to 4 pi", rate=2.0, stop=4 * math.pi),
    _path_1("stop at the fold", 1e-2, rate=0.01, stop=FOLD, damping=10.0, hold=30.0, snap=""),
    _path_1("stop 1e-6 past the fold", 1e-2, rate=0.01, stop=FOLD + 1e-6, damping=10.0, hold=120.0),
    _path_1("stop in the snap", stop=0.66, hold=1.0),
    _path_1("rate 1e-6, nu 1", rate=1e-6, stop=0.6),
    _path_1("rate 1e-6, nu 1e5", 1000.0, rate=1e-6, stop=0.6, damping=1e5),
    _path_1("ramp of one period", rate=0.3 / PERIOD, stop=0.3, damping=1e-3, hold=5.0, snap=""),
    _path_1("ramp of 1.5 periods", rate=0.2 / PERIOD, stop=0.3, damping=1e-3, hold=5.0, snap=""),
    _path_1("mirror image, U-S+", rate=-0.5, stop=-0.8, start="U-S+"),
    _path_1("8 nodes", stop=1.0, nodes=8),
    _path_1("401 nodes", nodes=401),
)

_NEUTRAL = "planar U of a rod of one stiffness turns freely about x: no isolated state"
_OUT_OF_PLANE = "planar U is unstable out of its plane beyond dL/L = 0.905"
_STEEP = "slopes beyond what its arclength can hold: the clamp alone needs more than dL"
PLANE = (
    _planar("planar, h/L 1e-4", 0.1, rate=0.005, damping=0.01, ribbon=THINNEST),
    # 16 and 1.267 follow
    _planar("planar, h/L 0.05", stop=1.25, ribbon=Ribbon(thickness=0.05)),
    _planar(
        "planar, EI1/EI2 1", refused={RODS: _NEUTRAL, KIRCHHOFF: _NEUTRAL}, ribbon=Ribbon(bending_ratio=1.0)
    ),
    _planar("planar, dL 0.001", rate=0.05, stop=0.1, compression=0.001),
    _planar(
        "planar, dL 0.95",
        refused={RODS: _OUT_OF_PLANE, KIRCHHOFF: _OUT_OF_PLANE},
        rate=1.0,
        stop=2.0,
        compression=0.95,
    ),
    _planar("planar, to 6 pi", refused={QUASILINEAR: _STEEP}, rate=2.0, stop=6 * math.pi),
    _planar("planar, rate 1000", rate=1000.0, hold=0.2),
    _planar("planar, stop at the fold", 1e-2, rate=0.01, stop=PLANAR_FOLD, damping=10.0, hold=10.0),
    _planar("planar, stop at 1e-6", rate=1.0, stop=1e-6, damping=0.0, hold=2.0, snap=""),
    _planar("planar, rate 1e-6, nu 1e5", 1000.0, rate=1e-6, stop=1.2, damping=1e5),
    _planar(
        "planar, ramp of 3 periods",
        rate=1.0 / (3.0 * PLANAR_PERIOD),
        stop=1.0,
        damping=1e-3,
        hold=3.0,
        snap="",
    ),
)

OWN = SIZES + RATIOS + SHEARS + STEPS + PLANE
CASES = KNOWN + OWN
