"""Every figure of the paper that numbers make, and its claims one by one: confirmed, corrected, or open."""

from .command import COMMAND, main

__all__ = ["COMMAND", "main"]
