"""Which shapes are skipped and which are chosen?  The paper's named cases (section 7)."""

from .command import COMMAND

__all__ = ["COMMAND"]
