"""Names of the states at alpha = 0 (U+S-, ...), by their signs, and what they become under symmetries."""

from __future__ import annotations

PLANAR_STATES = ("U+", "U-")
RIBBON_STATES = ("U+S+", "U+S-", "U-S+", "U-S-", "U+", "U-", "S+", "S-")
_OTHER_SIGN = str.maketrans("+-", "-+")


def swapped(name: str) -> str:
    """The name of a state with the sign of S exchanged."""
    if name[:1] == "S":
        return name.translate(_OTHER_SIGN)
    return name[:3] + name[3:].translate(_OTHER_SIGN)


def mirrored(name: str) -> str:
    """The name of a state's mirror image z -> -z: the sign of U exchanged."""
    return name if name[:1] == "S" else name[:2].translate(_OTHER_SIGN) + name[2:]
