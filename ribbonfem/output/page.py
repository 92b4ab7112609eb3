"""An interactive view of a motion as one HTML page that needs no network."""

from __future__ import annotations

import base64
import html
import json
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ribbonfem import Branch, History
from ribbonfem.options import whole_number
from ribbonfem.output.files import write_whole
from ribbonfem.results import Array

from .curve import Curve
from .surface import Strip, of_motion, state_name

# rows of a motion that its line is drawn through
_ROWS = 2000
# instants that a slider of some hundred pixels still tells apart, ten times over
_MOST = 5000
# characters of the surface in a page: nodes are left out beyond that, between those that are shown
_LARGEST = 8_000_000


def _runs(curve: Curve | None) -> list[dict[str, Any]]:
    """The stable and unstable stretches of a curve; a segment across a fold is unstable."""
    if curve is None or len(curve.angle) < 2:
        return []
    solid = curve.stable[:-1] & curve.stable[1:]
    # (between two curves there is nothing)
    there = np.isfinite(curve.height[:-1]) & np.isfinite(curve.height[1:])
    kind = np.where(there, solid, -1)
    starts = [0, *(np.flatnonzero(kind[1:] != kind[:-1]) + 1).tolist(), len(kind)]
    return [
        {"stable": bool(solid[a]), "rows": _rows(curve.angle[a : b + 1], curve.height[a : b + 1])}
        for a, b in pairwise(starts)
        if there[a]
    ]


def _rows(angle: Array, height: Array) -> list[list[float]]:
    return [[round(float(a), 6), round(float(z), 6)] for a, z in zip(angle, height, strict=True)]


def _window(history: History, curve: Curve | None) -> list[float]:
    """The angles of the motion, and the heights of it and of the curve there: low, high, low, high."""
    low, high = float(history.control.min()), float(history.control.max())
    beside = 0.03 * max(high - low, 1e-3)
    low, high = low - beside, high + beside
    heights = history.height
    if curve is not None:
        seen = curve.height[(curve.angle >= low) & (curve.angle <= high)]
        heights = np.concatenate((heights, seen))
    bottom, top = float(heights.min()), float(heights.max())
    margin = 0.06 * max(top - bottom, 1e-3)
    return [low, high, bottom - margin, top + margin]


def _data(history: History, strip: Strip, curve: Curve | None) -> dict[str, Any]:
    """What the page's code reads."""
    most = _LARGEST * 3 // (4 * 24 * len(strip.time))
    shown = np.unique(np.linspace(0, len(strip.s) - 1, min(len(strip.s), max(most, 2))).round().astype(int))
    points = strip.edges[:, :, shown]
    flat = points.reshape(-1, 3)
    middle = 0.5 * (flat.min(axis=0) + flat.max(axis=0))
    some = np.unique(np.linspace(0, len(history) - 1, min(len(history), _ROWS)).round().astype(int))
    columns = {name: np.round(getattr(strip, name), 6).tolist() for name in ("time", "angle", "height")}
    turning, drive = history.scene.clamps_turn, history.scene.drive
    return columns | {
        "name": "α" if turning else drive if isinstance(drive, str) else "control",
        "unit": history.scene.drives.unit,
        "frames": len(strip.time),
        "nodes": len(shown),
        "state": [state_name(z, s) for z, s in zip(strip.height, strip.slope, strict=True)],
        "centre": middle.tolist(),
        "radius": float(np.linalg.norm(flat - middle, axis=1).max()),
        "window": _window(history, curve),
        "curve": _runs(curve),
        "motion": _rows(history.control[some], history.height[some]),
        "points": base64.b64encode(points.astype("<f4").tobytes()).decode("ascii"),
    }


def page(
    history: History, curve: Curve | Branch | None = None, *, frames: int = 200, until: float | None = None
) -> str:
    """The page as text; arguments and errors as of `view`."""
    whole_number("frames", frames, 2, _MOST)
    if isinstance(curve, Branch):
        curve = Curve.of(curve)
    data = json.dumps(_data(history, of_motion(history, frames, until), curve), separators=(",", ":"))
    scene = history.scene
    title = f"{scene.start}, {scene.in_words.replace(f', {scene.start}', '')}: {history.model}"
    here = files("ribbonfem") / "output"
    text = (here / "page.html").read_text(encoding="utf-8")
    # nothing that is put in may end the script that it stands in
    parts = {
        "title": html.escape(title),
        "data": data.replace("</", "<\\/"),
        "code": (here / "page.js").read_text(encoding="utf-8"),
    }
    for name, content in parts.items():
        text = text.replace(f"[[{name}]]", content)
    return text


def view(
    history: History,
    path: str | Path,
    curve: Curve | Branch | None = None,
    *,
    frames: int = 200,
    until: float | None = None,
) -> Path:
    """Write an interactive view of a motion: it opens from disk in any browser, and asks no host.

    The ribbon's surface turns with the mouse, a finger or the arrow keys; a slider goes through time, and
    z(1/2)/L against the control stands beside it with the instant marked.

    Parameters
    ----------
    history: with configurations.
    path: of the page, ending in .html; its folder is made where there is none.
    curve: of equilibria, drawn behind the motion.
    frames: how many instants, at equal distances of time, 2 to 5000; of very many, or of a very fine mesh,
        fewer nodes are shown, so that the page stays below 10 MB.
    until: s, the last instant; by default the end.

    Returns
    -------
    The path.

    Raises
    ------
    ValueError
        For a motion without configurations, another ending, or a number of frames that cannot be.
    OSError
        If the file cannot be written.
    """
    where = Path(path)
    if where.suffix != ".html":
        raise ValueError(f"{where}: an interactive view ends in .html")
    write_whole(where, page(history, curve, frames=frames, until=until))
    return where
