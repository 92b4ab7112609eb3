"""The laws by which the cheapest model is chosen, measured anew."""

from .study import COMMAND

__all__ = ["COMMAND"]
