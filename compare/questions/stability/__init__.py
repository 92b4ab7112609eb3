"""Hard cases, in motion and at rest, with every method and model."""

from .question import QUESTION

__all__ = ["QUESTION"]
