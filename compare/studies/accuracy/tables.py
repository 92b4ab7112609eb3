"""Tables of the accuracy report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from compare.quantities.convergence import Convergence
from compare.report.section import Table

from .cases import DYNAMIC, STATIC
from .fronts import Candidate, Row, distance, front
from .orders import Study
from .references import Reference


def _short(label: str) -> str:
    """A policy in fewer words, for tables."""
    for long, brief in (("clamp=centred,", ""), ("clamp=", ""), ("method=", ""), ("tolerance=", "tol ")):
        label = label.replace(long, brief)
    return label.replace(",clamp=centred", "").replace("step=", "step ").replace(",", ", ")


def rows_table(rows: Sequence[Row], title: str) -> Table:
    """Rows one by one, with what names them."""
    shown = []
    for row in rows:
        e = row.errors
        first = e.get("fold", e.get("snap"))
        shown.append(
            [row.entry.key, row.entry.dofs, row.steps, first]
            + [e.get(name) for name in ("shape", "energy", "balance")]
            + [row.seconds]
        )
    return Table(
        title,
        ["row", "dofs", "steps", "angle (rad)", "shape (L)", "energy", "balance", "CPU s"],
        shown,
        ["s", "d", "d", ".2e", ".2e", ".2e", ".2e", ".4f"],
        "Errors: of the fold's or the snap's angle, the shape in L2, the energy and its balance in EI2/L. "
        "Computed alone by: ribbonfem accuracy --row ROW",
    )


def _nearest(choice: Candidate, members: Sequence[Candidate], quantity: str) -> Candidate:
    """The quickest of a front that is at least as exact as a choice."""
    exact = [m for m in members if m.settled[quantity] <= choice.settled[quantity]]
    return min(exact, key=lambda m: m.seconds, default=choice)


def defaults_of_fronts(found: Mapping[tuple[str, str], list[Candidate]]) -> list[dict[str, Any]]:
    """How far each default is from its front, in every quantity."""
    records = []
    for (group, family), its in found.items():
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
    return Table(
        "The defaults against the fronts",
        ["group", "model", "default", "error", "settled", "CPU s", "factor", "shape", "energy"]
        + ["quickest as exact", "settled", "CPU s"],
        [
            [
                r["group"],
                r["family"],
                _short(r["policy"]),
                r["error"],
                r["settled"],
                r["seconds"],
                r["distance"],
            ]
            + [r["distances"]["shape"], r["distances"]["energy"]]
            + [_short(r["instead"]), r["instead_settled"], r["instead_seconds"]]
            for r in records
        ],
        ["s", "s", "s", ".1e", ".1e", ".4f", ".2f", ".2f", ".2f", "s", ".1e", ".4f"],
        "error: of the fold or snap angle (rad), root mean square over the group's scenes; settled: the "
        "largest of it and of all finer policies of its kind, so that errors of mesh and step that cancel "
        "by chance do not count. CPU s: sum over the scenes. factor: CPU seconds over those of the "
        "model's front at the same settled error, interpolated in log-log; shape and energy: the same for "
        "these errors.",
    )


def fronts_table(found: Mapping[tuple[str, str], list[Candidate]]) -> Table:
    """The members of all fronts."""
    rows: list[list[Any]] = []
    for (group, family), its in found.items():
        quantity = (DYNAMIC if group.startswith("dynamic") else STATIC)[0]
        for member in front(its, quantity):
            e = member.errors
            rows.append(
                [group, family, _short(member.label) + (" (default)" if member.default else ""), member.dofs]
                + [member.settled[quantity], e[quantity], e["shape"], e["energy"], member.seconds]
            )
    return Table(
        "The fronts: no other policy of the model is quicker and more exact",
        ["group", "model", "policy", "dofs", "settled", "angle (rad)", "shape (L)", "energy", "CPU s"],
        rows,
        ["s", "s", "s", "d", ".1e", ".1e", ".1e", ".1e", ".4f"],
        "A policy that fails in any scene, planar or ribbon, is in none. Of policies whose errors differ by "
        "less than a twentieth the quickest is. "
        "Computed alone by: ribbonfem accuracy --group GROUP --model MODEL",
    )


def orders_table(studied: Sequence[tuple[Study, Convergence]]) -> Table:
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
        doubt = ref.uncertainty.get("fold", ref.uncertainty.get("snap"))
        rows.append(
            [f"{group}/{case}", kind, shown, doubt, ref.source, checks, "yes" if ref.verified else "no"]
        )
    return Table(
        "References",
        ["scene", "of", "angle (rad)", "+-", "from", "differences from other solutions", "verified"],
        rows,
        ["s", "s", "s", ".1e", "s", "s", "s"],
        "Angles of folds or snaps, differences in rad. Shape and energy at rest: elliptic functions of the "
        "inextensible beam, trigonometric ones of the quasi-linear one, else as the angle.",
    )
