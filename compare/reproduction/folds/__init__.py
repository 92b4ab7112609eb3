"""Folds and states of the ribbon at rest, finite elements against rods."""

from .command import QUESTION

__all__ = ["QUESTION"]
