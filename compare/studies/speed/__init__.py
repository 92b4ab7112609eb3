"""How fast is the rod's time loop, and where does its time go?"""

from .study import COMMAND, parts_of_an_iteration, reference_kernel

__all__ = ["COMMAND", "parts_of_an_iteration", "reference_kernel"]
