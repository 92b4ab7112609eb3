"""Speed against error of every model, mesh, method and step."""

from .study import QUESTION

__all__ = ["QUESTION"]
