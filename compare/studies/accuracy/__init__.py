"""Speed against error of every model, mesh, method and step."""

from .study import COMMAND

__all__ = ["COMMAND"]
