"""The laws by which the cheapest model is chosen, measured anew."""

from .question import QUESTION

__all__ = ["QUESTION"]
