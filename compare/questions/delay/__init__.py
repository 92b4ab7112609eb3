"""How late a snap comes, against theory."""

from compare.paper.delays import Cell, rates_for, ratio_limit, slope_of

from .question import QUESTION, main

__all__ = ["QUESTION", "Cell", "main", "rates_for", "ratio_limit", "slope_of"]
