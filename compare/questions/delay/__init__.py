"""How late a snap comes, against theory."""

from .question import QUESTION, main, ratio_limit, slope_of
from .systems import Cell, rates_for

__all__ = ["QUESTION", "Cell", "main", "rates_for", "ratio_limit", "slope_of"]
