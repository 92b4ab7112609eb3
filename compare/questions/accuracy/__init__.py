"""Speed against error of every model, mesh, method and step."""

from .question import main

__all__ = ["main"]
