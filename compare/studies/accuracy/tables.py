"""Tables of the accuracy study: defaults, fronts, orders, references."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from compare.quantities.convergence import Convergence
from compare.report.section import Table

from .cases import DYNAMIC, STATIC
from .fronts import Candidate, Row, distance, front
from .orders import Refined
from .references import Reference


def _short(label: str) -> str:
    """A configuration in fewer words, for tables."""
    for long, brief in (("clamp=centred,", ""), ("clamp=", ""), ("method=", ""), ("tolerance=", "tol ")):
        label = label.replace(long, brief)
    return label.replace(",clamp=centred", "").replace("step=", "step ").replace(",", ", ")


def rows_table(rows: Sequence[Row], title: str) -> Table:
    """Rows one by one, with what names them."""
    return Table.of(
        title,
        rows,
        [
            *(("row", "s", lambda row: row.entry.key), ("dofs", "d", lambda row: row.entry.dofs)),
            ("steps", "d", "steps"),
            ("angle (rad)", ".2e", lambda row: row.errors.get("fold", row.errors.get("snap"))),
            ("shape (L)", ".2e", lambda row: row.errors.get("shape")),
            ("energy", ".2e", lambda row: row.errors.get("energy")),
            ("balance", ".2e", lambda row: row.errors.get("balance")),
            ("CPU s", ".4f", "seconds"),
        ],
        "Errors: of the fold's or the snap's angle, the shape in L2, the energy and its balance in EI2/L. "
        "Computed alone by: ribbonfem accuracy --row ROW",
    )


def _nearest(choice: Candidate, members: Sequence[Candidate], quantity: str) -> Candidate:
    """The quickest of a front that is at least as exact as a choice."""
    exact = [m for m in members if m.settled[quantity] <= choice.settled[quantity]]
    return min(exact, key=lambda m: m.seconds, default=choice)


def defaults_of_fronts(result: Mapping[tuple[str, str], list[Candidate]]) -> list[dict[str, Any]]:
    """How far each default is from its front, in every quantity."""
    records = []
    for (group, family), its in result.items():
        names = DYNAMIC if group.startswith("dynamic") else STATIC
        for choice in (c for c in its if c.default):
            fronts = {name: front(its, name) for name in names}
            best = _nearest(choice, fronts[names[0]], names[0])
            records.append(
                {
                    "group": group,
                    "family": family,
                    "policy": choice.label,
                    "error": choice.errors[names[0]],
                    "settled": choice.settled[names[0]],
                    "seconds": choice.seconds,
                    "distance": distance(choice, fronts[names[0]], names[0]),
                    "distances": {name: distance(choice, fronts[name], name) for name in names},
                    "instead": best.label,
                    "instead_seconds": best.seconds,
                    "instead_settled": best.settled[names[0]],
                }
            )
    return records


def defaults_table(records: Sequence[Mapping[str, Any]]) -> Table:
    """Each default against its front."""
    return Table.of(
        "The defaults against the fronts",
        records,
        [
            *(("group", "s", "group"), ("model", "s", "family")),
            ("default", "s", lambda r: _short(r["policy"])),
            *(("error", ".1e", "error"), ("settled", ".1e", "settled"), ("CPU s", ".4f", "seconds")),
            ("factor", ".2f", "distance"),
            ("shape", ".2f", lambda r: r["distances"]["shape"]),
            ("energy", ".2f", lambda r: r["distances"]["energy"]),
            ("quickest as exact", "s", lambda r: _short(r["instead"])),
            *(("settled", ".1e", "instead_settled"), ("CPU s", ".4f", "instead_seconds")),
        ],
        "error: of the fold or snap angle (rad), root mean square over the group's scenes; settled: the "
        "largest of it and of all finer configurations of its kind, so that errors of mesh and step that "
        "cancel by chance do not count. CPU s: sum over the scenes. factor: CPU seconds over those of the "
        "model's front at the same settled error, interpolated in log-log; shape and energy: the same for "
        "these errors.",
    )


def fronts_table(result: Mapping[tuple[str, str], list[Candidate]]) -> Table:
    """The members of all fronts."""
    quantity = {group: (DYNAMIC if group.startswith("dynamic") else STATIC)[0] for group, _ in result}
    return Table.of(
        "The fronts: no other configuration of the model is quicker and more exact",
        [member for (group, _), its in result.items() for member in front(its, quantity[group])],
        [
            *(("group", "s", "group"), ("model", "s", "family")),
            ("options", "s", lambda c: _short(c.label) + (" (default)" if c.default else "")),
            ("dofs", "d", "dofs"),
            ("settled", ".1e", lambda c: c.settled[quantity[c.group]]),
            ("angle (rad)", ".1e", lambda c: c.errors[quantity[c.group]]),
            ("shape (L)", ".1e", lambda c: c.errors["shape"]),
            *(("energy", ".1e", lambda c: c.errors["energy"]), ("CPU s", ".4f", "seconds")),
        ],
        "A configuration that fails in any scene, planar or ribbon, is in none. Of configurations whose "
        "errors differ by less than a twentieth the quickest is. "
        "Computed alone by: ribbonfem accuracy --group GROUP --model MODEL",
    )


def orders_table(studied: Sequence[tuple[Refined, Convergence]]) -> Table:
    """The convergence studies."""
    return Table(
        "Observed orders",
        ["group", "model, method", "quantity", "over", "order", "declared", "verified"],
        [
            [s.group, s.label, s.quantity, f"{c.over} {c.at[0]:g} .. {c.at[-1]:g}", c.order, c.expected]
            + ["yes" if c.verified else "no"]
            for s, c in studied
        ],
        ["s", "s", "s", "s", ".2f", ".0f", "s"],
        "order: of the three finest runs. verified: the orders agree with the one declared, so that the "
        "limit taken from them is one.",
    )


def references_table(known: Mapping[tuple[str, str, str], Reference]) -> Table:
    """The references and their checks."""
    rows = []
    for (group, case, kind), ref in known.items():
        angle = ref.values.get("fold", ref.values.get("snap"))
        shown = ", ".join(f"{a:.8f}" for a in np.atleast_1d(angle))
        checks = "; ".join(f"{name}: {value:.1e}" for name, value in ref.checks.items())
        uncertainty = ref.uncertainty.get("fold", ref.uncertainty.get("snap"))
        rows.append(
            [f"{group}/{case}", kind, shown, uncertainty, ref.source, checks, "yes" if ref.verified else "no"]
        )
    return Table(
        "References",
        ["scene", "of", "angle (rad)", "+-", "from", "differences from other solutions", "verified"],
        rows,
        ["s", "s", "s", ".1e", "s", "s", "s"],
        "Angles of folds or snaps, differences in rad. Shape and energy at rest: elliptic functions of the "
        "inextensible beam, trigonometric ones of the quasi-linear one, else as the angle.",
    )
