"""The paper's diagrams over rate and damping (Figs. 11 and 14), and the runs that it names in them."""

from __future__ import annotations

from compare.diagrams.show import Named

SKIPPING = tuple((compression, 0.40) for compression in (0.40, 0.39, 0.38, 0.37, 0.36, 0.35))
NAMED_SKIPPING = {
    0.40: (
        Named(0.01, 0.1, "no skip", "Fig. 10A"),
        Named(1.0, 0.1, "type 2", "Fig. 10A"),
        Named(0.01, 10.0, "no skip", "Fig. 10B"),
        Named(1.0, 10.0, "type 2", "Fig. 10B"),
    ),
    0.35: (
        Named(0.01, 0.3, "type 1", "Fig. 10C"),
        Named(1.0, 0.3, "type 2", "Fig. 10C"),
        Named(0.01, 30.0, "no skip", "Fig. 10D"),
        Named(1.0, 30.0, "type 2", "Fig. 10D"),
    ),
}
SELECTION = ((0.40, 0.40, 0.36), (0.35, 0.40, 0.27))
NAMED_SELECTION = {
    0.40: (
        Named(0.01, 0.1, "U+S-", "Fig. 12A"),
        Named(1.0, 0.1, "U-S+", "Fig. 12A"),
        Named(0.01, 10.0, "U+S-", "Fig. 12B"),
        Named(1.0, 10.0, "U+S-", "Fig. 12B"),
    ),
    0.35: (
        Named(0.01, 0.3, "U-S+", "Fig. 13A"),
        Named(1.0, 0.3, "U-S+", "Fig. 13A"),
        Named(0.01, 30.0, "U+S-", "Fig. 13B"),
        Named(1.0, 30.0, "U+S-", "Fig. 13B"),
    ),
}
