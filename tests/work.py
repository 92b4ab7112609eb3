"""Work for sweeps in processes of their own: exact, of a moment, and of a module that is loaded at once."""

import math
import time


def work(k):
    time.sleep(0.01)
    return math.sin(k)
