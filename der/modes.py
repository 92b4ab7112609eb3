"""The old place of `ribbonfem.outcomes` for rods: names of shapes, outcomes of runs."""

from ribbonfem.outcomes import (
    Instant,
    Outcome,
    classify,
    events,
    local_minima,
    name_by_signs,
    name_shape,
)

__all__ = ["Instant", "Outcome", "classify", "events", "local_minima", "name_by_signs", "name_shape"]
