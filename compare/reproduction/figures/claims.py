"""The list of all claims of the paper that are judged, and of its contradictions."""

from __future__ import annotations

from .claims_modes import CLAIMS as MODES
from .claims_motion import CLAIMS as MOTION
from .claims_rest import CLAIMS as REST
from .verdict import Claim

GROUPS: dict[str, tuple[Claim, ...]] = {
    "at rest": REST,
    "delayed snaps": MOTION,
    "skipping and selection": MODES,
}
CLAIMS = tuple(claim for group in GROUPS.values() for claim in group)
# of what, the paper, taken here
CHOICES: list[list[str]] = [
    [
        "the stiff axis",
        "m1 along the width and m2 the normal in the text; m1 the normal in the boundary conditions",
        "m1 is the normal and EI1 = 400 EI2 bending about it, in the ribbon's plane; m2 is along the width",
    ],
    [
        "the sign of the angle",
        "phi(0) = +alpha of the planar beam, the tangent [cos alpha, 0, -sin alpha] of the ribbon",
        "the ribbon's: alpha > 0 turns the left tangent down and drives U+ towards U-; the fold met from "
        "U+ has Z > 0",
    ],
    [
        "section",
        "W = 0.1, h = 0.01, whose EI1/EI2 is 100, and EI1/EI2 = 400, GJ/EI2 = 1.4562",
        "the ratios, which are those of W = 20 h and Poisson's ratio 0.33; the rotary inertia has W = 0.2",
    ],
    [
        "damping",
        "nu is called dimensionless",
        "nu in 1/s, a force -nu M v; nu t*, t* = (rho h L^4 / B)^(1/2), is the dimensionless one",
    ],
    [
        "S+ and S-",
        "exchanged between the captions of Fig. 4 and the text of section 2",
        "the text: under alpha > 0 Path 1 starts at U+S- with one fold, Path 2 at U+S+ with two",
    ],
    [
        "time delays",
        "section 6.1 has -1/5 overdamped and -1/3 underdamped, section 4.4 the reverse",
        "section 4.4: rate^(-1/5) where inertia rules, rate^(-1/3) nu^(2/3) where damping does",
    ],
    ["fast selection", "100 rad/s in the text, 1.00 in the caption of Fig. 12", "both are run"],
    [
        "fast skipping at dL/L = 0.35",
        "0.01 rad/s in the text, 1.00 in the caption of Fig. 10",
        "1.00; 0.01 is the slow one",
    ],
    [
        "type of skipping",
        "by whether the first minimum of z comes before alpha_c2, and an overdamped z has none",
        "type 1: z passes 0 before alpha_c2; no skip: it comes back from a minimum above 0, or rests near "
        "U+S-; else type 2",
    ],
    [
        "the damping of Figs. 9 C and D",
        "mu in the text where nu is meant",
        "nu",
    ],
]
