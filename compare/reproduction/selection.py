"""Which shape does a ramp that stops select?  Diagrams over rate and damping, with shares (Fig. 14)."""

from .rate_damping import command

COMMAND = command(
    "selection",
    """Draw in which shape a ramp from U+S+ to --stop (rad), then held, comes to rest (paper, Fig. 14).

    A cell of --rates and --dampings (LOW:HIGH:COUNT) is an area: it gets the shares of shapes, from a few
    runs where they agree and up to --samples where they do not. Changes between sure cells are solved for
    to 1 %. --all: the paper's two; --paper: also in the paper's own setting, and where that differs;
    --model both: finite elements and rods, and where their intervals are disjoint.
    """,
    "some 4 minutes a diagram",
)
