"""Many runs: tasks, the store of finished ones, worker processes, and the runner that joins them."""

from .progress import Progress
from .runner import Sweep, SweepError
from .task import Failure, Task

__all__ = ["Failure", "Progress", "Sweep", "SweepError", "Task"]
