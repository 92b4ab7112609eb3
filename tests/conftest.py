"""In which order files of tests are begun, and which of them run in one process.

The longest first, so that two processes end at the same time; none waits for what the other compiles.
"""

from pathlib import Path

import pytest
from xdist.scheduler import LoadFileScheduling

# parts of the same kernels: a process that knows one compiles the next in half the time
KERNELS = (
    "test_compilation",
    "test_kirchhoff_motion",
    "test_elastica",
    "test_quasilinear_dynamics",
    "test_time_loop",
)
LONGEST = (
    *KERNELS,
    # what needs none of the code that those compile meanwhile
    "test_diagrams",
    "test_sweep",
    "test_compare_folds",
    "test_der_motion",
    "test_kirchhoff",
    "test_figures",
    "test_rounding",
    "test_crosscheck",
    "test_cluster",
    "test_surroundings",
    "test_snap_delay",
    "test_chooser",
    "test_command_line",
    "test_compare_motion",
    "test_documents",
    "test_validation",
    "test_interrupts",
    "test_modes",
    "test_near_pitchforks",
    "test_stability",
)


def pytest_collection_modifyitems(items):
    place = {name: number for number, name in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(item.path.stem, len(place)))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """By files, as "loadfile" does, but for files of the same kernels, which go to one process."""
    return Files(config, log)


class Files(LoadFileScheduling):
    def _split_scope(self, nodeid):
        file = super()._split_scope(nodeid)
        return "kernels" if Path(file).stem in KERNELS else file
