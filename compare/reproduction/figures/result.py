"""The result class of the command `figures`, enough to draw and judge everything again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from inspect import signature
from typing import Any, TypeVar

from compare.diagrams.report import Diagrams
from compare.reproduction.delays import Delays
from compare.reproduction.paths import Swept

from .at_rest import Phases, Planar, Ribbons, Snapshot, States
from .in_motion import Bound, Moved, Settled


@dataclass(frozen=True)
class Figures:
    """What was found; a part whose figure was not asked for is None or empty.

    Attributes
    ----------
    chosen: names of the figures.
    snapshots, planar, ribbons, swept: of Figs. 2, 3, 4 and 5.
    moved: of Figs. 6, 8 and 9, by system.
    delays: of Figs. 7, 8 and 9.
    width: snap angles of Path 1 at 1 rad/s with two widths, rad.
    settled: of Figs. 10, 12 and 13; bounds: beside Fig. 10.
    skipping, selection: of Figs. 11 and 14.
    states, phases: of Figs. 15 and 16.
    """

    chosen: tuple[str, ...]
    snapshots: tuple[Snapshot, ...] = ()
    planar: Planar | None = None
    ribbons: Ribbons | None = None
    swept: dict[str, tuple[Swept, ...]] | None = None
    moved: dict[str, Moved] | None = None
    delays: Delays | None = None
    width: tuple[float, float] | None = None
    settled: Settled | None = None
    bounds: tuple[Bound, ...] = ()
    skipping: Diagrams | None = None
    selection: Diagrams | None = None
    states: States | None = None
    phases: Phases | None = None


Made = TypeVar("Made")
_PARTS = tuple(item.name for item in fields(Figures))


def of_parts(function: Callable[..., Made], result: Figures, *more: Any) -> Made:
    """What a function makes of the parts of a result that its first parameters name, and of `more`."""
    parts = []
    for name in signature(function).parameters:
        if name in _PARTS:
            part = getattr(result, name)
            assert part is not None
            parts.append(part)
    return function(*parts, *more)
