"""Names of shapes and outcomes of runs, as `ribbonfem.outcomes` has them for every model."""

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
