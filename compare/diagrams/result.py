"""The result class `Diagram`: shares of outcomes in cells of two numbers of a scene, with boundaries."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbonfem import Scene
from ribbonfem.frozen import Value, called_later
from ribbonfem.options import choice
from ribbonfem.results import Array

from .axes import Axis, unit_of
from .boundaries import Boundary
from .setup import RATE_AND_DAMPING, Sample


@dataclass(frozen=True)
class Failed:
    """A run that did not end, and why; x and y as of a `Sample`."""

    x: float
    y: float
    reason: str

    rate = property(attrgetter("x"), doc="x, of a diagram over rate and damping.")
    damping = property(attrgetter("y"), doc="y, of a diagram over rate and damping.")


def told(scene: Scene) -> tuple[str, ...]:
    """Phrases for what is not the usual rig from U+S+: the start, what is driven, presets, loads."""
    return (*((scene.start,) if scene.start != "U+S+" else ()), *scene.rig)


def place(scene: Scene, over: tuple[str, str], form: str = "g") -> str:
    """(dL/L, dW/L), or that of both which does not vary, and of other diagrams the rate and the damping."""
    own = {"dL/L": ("compression", scene.compression), "dW/L": ("shear", scene.shear)}
    fixed = {name: f"{value:{form}}" for name, (field, value) in own.items() if field not in over}
    parts = [f"({', '.join(fixed.values())})"] if len(fixed) == 2 else [f"{n} {v}" for n, v in fixed.items()]
    if "damping" not in over:
        parts.append(f"nu {scene.damping:g}")
    if "rate" not in over:
        parts.append(f"{scene.rate:g} {unit_of('rate', scene)}")
    return ", ".join(parts)


def stop_in_words(scene: Scene, over: tuple[str, str] = RATE_AND_DAMPING) -> str:
    """Where a ramp stops, as the last part of a list; empty where it does not, or where that varies."""
    if scene.stop is None or "stop" in over:
        return ""
    return f", stop {scene.stop:g} {scene.drives.unit}".rstrip()


@dataclass(frozen=True, repr=False, eq=False)
class Diagram(Value):
    """What ramps do, over cells of two numbers of a scene, usually of rate and damping.

    Attributes
    ----------
    kind: "skipping" or "selection".
    x, y: (n,) and (m,) centres of the cells; a cell reaches half a spacing to every side, of what is counted
        by factors in the logarithm.  `rates` (of the control: rad/s, L/s, ...) and `dampings` (1/s) are the
        same where these vary.
    outcomes: names, in the order of the shares.
    shares: (m, n, outcomes) of the runs that ended; NaN where none did.
    uncertainty: (m, n) half the 95 % interval of the largest share.
    runs: (m, n) runs that ended.
    outcome: (m, n) the common outcome where all runs agree; "cut" where one line separates two; "mixed" where
        none does, however many runs: only these cells are undetermined; empty where no run ended.
    failed: the runs that did not end.
    boundaries: where the outcome changes, solved for between sure cells, on the mesh of the runs.
    samples: every run, row by row and cell by cell.
    folds: where the control is at alpha_c1 and alpha_c2; of selection with another rig at those that a slow
        ramp meets; none where they vary from run to run.
    predicted: curves that need no simulation, by name: (k, 2) rates and dampings.
    scene, model, options, seed: what it was made from.
    unpredicted: of these curves those that are not there, by name: why.
    over: the names of what varies, across and up.
    """

    kind: str
    x: Array
    y: Array
    outcomes: tuple[str, ...]
    shares: Array
    uncertainty: Array
    runs: NDArray[np.int64]
    outcome: NDArray[np.str_]
    failed: tuple[Failed, ...]
    boundaries: tuple[Boundary, ...]
    samples: tuple[Sample, ...]
    folds: tuple[float, ...]
    predicted: Mapping[str, Array]
    scene: Scene
    model: str
    options: Mapping[str, Any]
    seed: int
    unpredicted: Mapping[str, str] = field(default_factory=dict)
    over: tuple[str, str] = RATE_AND_DAMPING

    @property
    def axes(self) -> tuple[Axis, Axis]:
        """What varies, across and up."""
        return Axis(self.over[0], self.x), Axis(self.over[1], self.y)

    def values(self, name: str) -> Array:
        """The centres of the cells along one of the two numbers.

        Raises
        ------
        OptionError
            If that one does not vary.
        """
        choice("name", name, self.over)
        return self.x if name == self.over[0] else self.y

    @property
    def rates(self) -> Array:
        """Of the control, where they vary."""
        return self.values("rate")

    @property
    def dampings(self) -> Array:
        """1/s, where they vary."""
        return self.values("damping")

    def __repr__(self) -> str:
        counts = Counter(str(name) or "no run ended" for name in self.outcome.ravel())
        cells = ", ".join(f"{count} {name}" for name, count in counts.most_common())
        scene = self.scene
        where = ", ".join((place(scene, self.over), *told(scene)))
        over = "" if self.over == RATE_AND_DAMPING else f" over {' and '.join(self.over)}"
        return (
            f"Diagram({self.kind} at {where}{stop_in_words(scene, self.over)}{over}, {self.model}, "
            f"{len(self.y)} x {len(self.x)} cells of {int(self.runs.sum())} runs;\n"
            f"  {cells};\n  {len(self.boundaries)} boundaries, {len(self.failed)} runs failed"
            + "".join(f";\n  no line of {name}: {why}" for name, why in self.unpredicted.items())
            + ")"
        )

    doubt = property(attrgetter("uncertainty"), doc="The old name of `uncertainty`.")

    @property
    def undetermined(self) -> NDArray[np.bool_]:
        """(m, n) which cells no single run decides: "mixed"."""
        return np.asarray(self.outcome == "mixed")

    def plot(self, axes: Any = None) -> Any:
        """Draw its shares into axes of matplotlib, or new ones: see `compare.diagrams.show.plot`."""
        return called_later("compare.diagrams.show:plot", self, axes)

    def to_pandas(self) -> Any:
        """As a `pandas.DataFrame`: see `compare.diagrams.show.frame`."""
        return called_later("compare.diagrams.show:frame", self)

    def _repr_html_(self) -> Any:
        return called_later("compare.diagrams.show:html", self)

    def to_csv(self) -> str:
        """A tidy table: a row for each cell and outcome, with its share, uncertainty and runs.

        Where another control than the left clamp moves its name and its unit are in each.
        """
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        scene = self.scene
        named = (
            {} if scene.drive == "left" else {"drive": str(scene.drive), "rate_unit": unit_of("rate", scene)}
        )
        writer.writerow([*self.over, "outcome", "share", "cell", "runs", "doubt_of_largest", *named])
        for j, y in enumerate(self.y):
            for i, x in enumerate(self.x):
                for k, name in enumerate(self.outcomes):
                    writer.writerow(
                        [repr(float(x)), repr(float(y)), name, repr(float(self.shares[j, i, k]))]
                        + [str(self.outcome[j, i]), int(self.runs[j, i]), repr(float(self.uncertainty[j, i]))]
                        + [*named.values()]
                    )
        return stream.getvalue()

    def to_xarray(self) -> Any:
        """The same as an `xarray.Dataset`, where xarray is installed.

        Raises
        ------
        ImportError
            If it is not; says how to install it.
        """
        try:
            import xarray
        except ImportError:
            raise ImportError("to_xarray needs xarray: pip install xarray") from None
        across, up = self.over
        cells = (up, across)
        return xarray.Dataset(
            {
                "share": ((*cells, "outcome"), np.array(self.shares)),
                "doubt": (cells, np.array(self.uncertainty)),
                "runs": (cells, np.array(self.runs)),
                "cell": (cells, np.array(self.outcome)),
            },
            {
                up: (up, np.array(self.y), {"units": unit_of(up, self.scene)}),
                across: (across, np.array(self.x), {"units": unit_of(across, self.scene)}),
                "outcome": list(self.outcomes),
            },
            {
                "kind": self.kind,
                "model": self.model,
                "drive": str(self.scene.drive),
                "scene": repr(self.scene),
                "seed": self.seed,
            },
        )
