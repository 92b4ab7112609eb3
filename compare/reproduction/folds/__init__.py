"""Folds and states of the ribbon at rest, finite elements against rods."""

from .command import COMMAND

__all__ = ["COMMAND"]
