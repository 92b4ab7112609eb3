"""Speed at equal error against other programs: planar snap, ribbon snap, the static branch."""

from .study import COMMAND

__all__ = ["COMMAND"]
