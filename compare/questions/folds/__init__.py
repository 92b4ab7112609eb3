"""Folds and states of the ribbon at rest, finite elements against rods."""

from .question import main

__all__ = ["main"]
