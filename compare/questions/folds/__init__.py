"""Folds and states of the ribbon at rest, finite elements against rods."""

from .question import QUESTION

__all__ = ["QUESTION"]
