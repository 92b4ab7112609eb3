"""What are modulus, damping, ...?  Numbers of a scene fitted to what was measured of it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from compare.fitting.fit import fit
from compare.fitting.result import Fit
from compare.report.section import Drawing, Table
from compare.sweep import Progress, Sweep
from ribbonfem.measured import Measured
from ribbonfem.options import number, refuse
from ribbonfem.output.scene_file import read_scene
from ribbonfem.output.style import figure

from ..report.registry import Command

# exit status where the fit is not to be relied on: its summary says why
NOT_MET = 3


def main(
    scene: Path,
    *,
    data: str,
    vary: tuple[str, ...] = ("damping",),
    uncertainty: tuple[str, ...] = (),
    sweep: Sweep | None = None,
) -> Fit:
    """Fit numbers of the scene in a TOML file to the rows of a file, --data.

    Its columns are headed as quantities, with their units: "time (ms)", "height (mm)", "force_right_x (N)";
    of states at rest "control (rad)" in place of the time. --vary are fields of Scene and Ribbon, which begin
    with the scene's values, and "offset", of the clock. --uncertainty is a standard deviation, in the unit of
    the quantity, where one is measured; of several height:0.2,slope:0.01; what is left out is estimated.
    """
    if not Path(data).is_file():
        refuse("data", data, "there is no such file")
    measured, stated = Measured.from_csv(data, uncertainty=_deviations(uncertainty)), read_scene(scene)
    progress = sweep.progress if sweep else Progress()
    (result,) = (fit(stated, measured, vary=vary) for _ in progress("fit", [stated]))
    return result


def _deviations(given: tuple[str, ...]) -> Any:
    """A number, or a mapping of names to numbers or columns, as `Measured.from_csv` takes it."""

    def value(text: str) -> float | str:
        try:
            return float(text)
        except ValueError:
            return text

    if len(given) == 1 and ":" not in given[0]:
        return number("uncertainty", value(given[0]))
    pairs = [part.partition(":") for part in given]
    for name, colon, text in pairs:
        if not (name and colon and text):
            refuse("uncertainty", ",".join(given), "one number, or NAME:NUMBER,NAME:NUMBER")
    return {name: value(text) for name, _, text in pairs} or None


def tables(result: Fit) -> Iterator[Table]:
    """The values."""
    rows = [
        [name, x, result.uncertainty[name], result.model_error[name], result.begun[name]]
        for name, x in result.values.items()
    ]
    heads = ["", "value", "±", "model's own error", "begun at"]
    yield Table("Fitted values", heads, rows, ["s", ".7g", ".2g", ".1e", ".5g"])


def drawings(result: Fit) -> Iterator[Drawing]:
    """What was measured and the fit to it, a picture a quantity."""
    for name in result.measured[0].measured:
        fig, axes = figure(1, width=5.0)
        result.plot(axes, quantity=name)
        yield Drawing(f"fit-{name}.png", f"Measured {name}, the fit, and residuals above.", fig)


def values(result: Fit) -> dict[str, Any]:
    """The numbers for programs."""
    names = (
        "values",
        "uncertainty",
        "model_error",
        "converged",
        "met",
        "chi2",
        "degrees",
        "undetermined",
        "model",
    )
    return {name: getattr(result, name) for name in names} | {"runs": result.runs}


COMMAND = Command(
    name="fit",
    title="A fit to what was measured",
    takes="some seconds",
    main=main,
    summary=lambda result: [f"{result!r}.", *result.summary()],
    tables=tables,
    drawings=drawings,
    values=values,
    status=lambda result: 0 if result.met else NOT_MET,
)
