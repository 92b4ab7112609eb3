"""Hard cases, in motion and at rest, with every method and model."""

from .study import COMMAND

__all__ = ["COMMAND"]
