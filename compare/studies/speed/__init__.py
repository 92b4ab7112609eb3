"""How fast the rods' time loop is, and what a snap costs by each model at an equal error."""

from .study import COMMAND, Speed

__all__ = ["COMMAND", "Speed"]
