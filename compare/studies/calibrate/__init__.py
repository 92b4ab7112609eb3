"""The laws by which the cheapest model is chosen, measured anew."""

from .study import QUESTION

__all__ = ["QUESTION"]
