"""Which shapes are skipped and which are chosen?  The paper's named cases (section 7)."""

from .command import QUESTION

__all__ = ["QUESTION"]
