"""Hard cases, in motion and at rest, with every method and model."""

from .question import main

__all__ = ["main"]
