"""The classes of a claim of the paper and of its verdict; the claims are in `claims_*.py`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .result import Figures, of_parts

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


def judged(right: bool, number: str, error: str = "", correction: str = "") -> Verdict:
    """Confirmed, with a correction where there is one; else not confirmed."""
    return Verdict(NO if not right else CORRECTED if correction else YES, number, error, correction)


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper in other words.

    Attributes
    ----------
    figure: whose numbers decide, as "fig3".
    where: in the paper.
    says: what it says.
    judge: gives the verdict, of the parts of the result that its first parameters name, and of `more`.
    """

    figure: str
    where: str
    says: str
    judge: Callable[..., Verdict]
    more: tuple[Any, ...] = ()

    @property
    def command(self) -> str:
        """What shows it."""
        return f"ribbonfem figures --only {self.figure}"

    def of(self, result: Figures) -> Verdict:
        """The verdict of a result."""
        if self.figure not in result.chosen:
            return Verdict(NOT_ASKED, "")
        return of_parts(self.judge, result, *self.more)


def percent(value: float) -> str:
    """A share as a percentage with its sign."""
    return f"{100.0 * value:+.2g} %"
