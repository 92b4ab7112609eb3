"""What the command of the paper's figures found, enough to draw and judge everything again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

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
    asked: names of the figures.
    snapshots, planar, ribbons, swept: of Figs. 2, 3, 4 and 5.
    moved: of Figs. 6, 8 and 9, by system.
    delays: of Figs. 7, 8 and 9.
    width: snap angles of Path 1 at 1 rad/s with two widths, rad.
    settled: of Figs. 10, 12 and 13; bounds: beside Fig. 10.
    skipping, selection: of Figs. 11 and 14.
    states, phases: of Figs. 15 and 16.
    """

    asked: tuple[str, ...]
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


Part = TypeVar("Part")


def given(part: Part | None) -> Part:
    """A part of the result whose figure was asked for."""
    assert part is not None
    return part
