"""How fast is the rod's time loop, and where does its time go?"""

from .study import QUESTION, parts_of_an_iteration, reference_kernel

__all__ = ["QUESTION", "parts_of_an_iteration", "reference_kernel"]
