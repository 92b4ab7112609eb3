"""A claim of the paper and what the numbers say of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from .result import Figures

YES, CORRECTED, OPEN, NO, NOT_ASKED = (
    "confirmed",
    "confirmed with a correction",
    "not determined",
    "not confirmed",
    "not asked",
)


@dataclass(frozen=True)
class Verdict:
    """What the numbers say.

    Attributes
    ----------
    verdict: one of those above.
    number: what was found.
    error: how sure the number is.
    correction: what the paper should have said, or what stays open; empty where nothing.
    """

    verdict: str
    number: str
    error: str = ""
    correction: str = ""


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper in other words.

    Attributes
    ----------
    figure: whose numbers decide, as "fig3".
    where: in the paper.
    says: what it says.
    judge: the verdict, of a result that has the figure.
    """

    figure: str
    where: str
    says: str
    judge: Callable[[Figures], Verdict]

    @property
    def command(self) -> str:
        """What shows it."""
        return f"ribbonfem figures --only {self.figure}"

    def of(self, found: Figures) -> Verdict:
        """The verdict of a result."""
        return self.judge(found) if self.figure in found.asked else Verdict(NOT_ASKED, "")


def judged(right: bool, correction: str = "") -> str:
    """Confirmed, with a correction where there is one; else not confirmed."""
    if not right:
        return NO
    return CORRECTED if correction else YES


def percent(value: float) -> str:
    """A share as a percentage with its sign."""
    return f"{100.0 * value:+.2g} %"
