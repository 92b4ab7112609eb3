"""How late a snap comes, against theory."""

from compare.reproduction.delays import Cell, rates_for, ratio_limit, slope_of

from .command import COMMAND, main

__all__ = ["COMMAND", "Cell", "main", "rates_for", "ratio_limit", "slope_of"]
