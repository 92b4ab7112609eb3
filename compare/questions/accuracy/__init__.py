"""Speed against error of every model, mesh, method and step."""

from .question import QUESTION

__all__ = ["QUESTION"]
