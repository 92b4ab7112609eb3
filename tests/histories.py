"""What several files of tests ask of histories."""

import numpy as np


def assert_goes_on(whole, first, second):
    """That a motion gone on from the end of the first is the rest of the whole, to the last bit."""
    k = len(first) - 1
    for name in ("time", "control", "height", "slope", "load"):
        np.testing.assert_array_equal(getattr(whole, name)[k:], getattr(second, name))
    for name, energy in whole.energies.items():
        np.testing.assert_array_equal(energy[k:], second.energies[name])
