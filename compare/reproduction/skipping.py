"""Which shape does a ramp skip?  Diagrams over rate and damping, with shares and boundaries (Fig. 11)."""

from .rate_damping import command

COMMAND = command(
    "skipping",
    """Draw which shape a ramp from U+S+ skips, over rate and damping (paper, Fig. 11).

    A cell of --rates and --dampings (LOW:HIGH:COUNT) is an area: it gets the shares of outcomes, from a few
    runs where they agree and up to --samples where they do not. Changes between sure cells are solved for
    to 1 %. --all: the paper's six; --paper: also in the paper's own setting, and where that differs;
    --model both: finite elements and rods, and where their intervals are disjoint.
    """,
    "some 3 minutes a diagram",
)
