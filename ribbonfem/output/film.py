"""Films and stills of a ribbon in motion (GIF, MP4), beside its curve of z over alpha."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ribbonfem import Branch, History
from ribbonfem.output.files import whole
from ribbonfem.results import control_text

from .curve import Curve
from .perspective import fit
from .style import blank, control_label, draw_curve, in_style
from .surface import Strip, of_motion, of_result, state_name

_FACE, _BACK, _LINE = "#3d7ea6", "#e8a87c", "#1b3a4b"
_SECONDS = 0.05


def _as_placed() -> Any:
    """Axes stay where they are put; `layout="none"` is forgotten by matplotlib with the first frame saved."""
    from matplotlib.layout_engine import PlaceHolderLayoutEngine

    return PlaceHolderLayoutEngine(adjust_compatible=True, colorbar_gridspec=False)


class _Stage:
    """The axes of a film, and what in them moves."""

    def __init__(self, strip: Strip, curve: Curve | None, history: History | Branch) -> None:
        self.strip = strip
        clamps_turn = history.scene.clamps_turn
        self.control_text = (
            (lambda a: f"α = {a:.3f} rad")
            if clamps_turn
            else (lambda c: control_text(history.scene, c, ".3f"))
        )
        self.moves = isinstance(history, History)
        self.figure = blank(9.0, 4.5, dpi=100, layout=_as_placed())
        self.view = self.figure.add_axes((0.0, 0.32, 0.58, 0.68), projection="3d")
        self.above = self.figure.add_axes((0.09, 0.12, 0.40, 0.24))
        self.plot = self.figure.add_axes((0.66, 0.13, 0.32, 0.76))
        fit(self.view, strip.edges.reshape(-1, 3))
        self._from_above()
        if curve is not None:
            draw_curve(self.plot, curve.angle, curve.height, curve.stable, "0.65", width=1.0)
        self.plot.plot(history.control, history.height, color=_FACE, lw=1.0)
        (self.mark,) = self.plot.plot([], [], "o", color="#d1495b", ms=7, zorder=5)
        reach = max(float(np.ptp(history.control)), 1e-6)
        low, high = float(history.control.min()), float(history.control.max())
        self.plot.set(
            xlim=(low - 0.03 * reach, high + 0.03 * reach),
            xlabel=control_label(history.scene),
            ylabel="$z(1/2)/L$",
        )
        self.title = self.plot.set_title("", fontsize=10)
        self.moving: list[Any] = []

    def _from_above(self) -> None:
        points = self.strip.edges.reshape(-1, 3)
        low, high = points.min(axis=0), points.max(axis=0)
        self.above.set(
            xlim=(low[0] - 0.03, high[0] + 0.03), ylim=(low[1] - 0.03, high[1] + 0.03), aspect="equal"
        )
        self.above.set(xlabel="$x/L$", ylabel="$y/L$")

    def _clamps(self, edges: Any) -> list[Any]:
        return [
            self.view.plot(*edges[:, end].T, color=_LINE, lw=4.0, solid_capstyle="butt", clip_on=False)[0]
            for end in (0, -1)
        ]

    def show(self, frame: int) -> None:
        """Draw one instant."""
        for artist in self.moving:
            artist.remove()
        edges = self.strip.edges[frame]
        x, y, z = np.moveaxis(edges, -1, 0)
        # the normal tells the two faces apart
        up = self.strip.normal[frame, :, 2] > 0.0
        colours = np.where(up[None, :], _FACE, _BACK)
        surface = self.view.plot_surface(
            x, y, z, facecolors=colours, rstride=1, cstride=4, lw=0, antialiased=False, clip_on=False
        )
        outline = np.concatenate((edges[0], edges[1, ::-1]))
        (patch,) = self.above.fill(outline[:, 0], outline[:, 1], color=_FACE, alpha=0.75, lw=0)
        (line,) = self.above.plot(*self.strip.centre[frame, :, :2].T, color=_LINE, lw=0.8)
        self.moving = [surface, patch, line, *self._clamps(edges)]
        angle, height = float(self.strip.angle[frame]), float(self.strip.height[frame])
        self.mark.set_data([angle], [height])
        name = state_name(height, float(self.strip.slope[frame]))
        when = f"t = {self.strip.time[frame]:.3g} s, " if self.moves else ""
        self.title.set_text(f"{when}{self.control_text(angle)}: {name}")


def _writer(path: Path) -> Any:
    from matplotlib.animation import FFMpegWriter, PillowWriter

    if path.suffix == ".mp4":
        if shutil.which("ffmpeg") is None:
            raise ValueError(f"{path}: an MP4 needs ffmpeg, which is not installed; a .gif needs nothing")
        return FFMpegWriter(fps=round(1.0 / _SECONDS))
    if path.suffix != ".gif":
        raise ValueError(f"{path}: a film ends in .gif or, where ffmpeg is installed, in .mp4")
    return PillowWriter(fps=round(1.0 / _SECONDS))


def film(
    history: History | Branch,
    path: str | Path,
    *,
    curve: Curve | None = None,
    frames: int = 150,
    until: float | None = None,
    progress: Callable[[range], Any] = iter,
) -> Path:
    """A film of a motion, or of the states of a curve in its order: GIF, or MP4 where ffmpeg is installed.

    Parameters
    ----------
    history: with configurations, or a curve of equilibria.
    path: of the film; its ending says which kind.
    curve: of equilibria, drawn behind the motion.
    frames: how many, at equal distances of time; until, the last instant in s.
    progress: is given the numbers of the frames, and yields them.

    Raises
    ------
    ValueError
        For a motion without configurations, or a kind of film that cannot be made.
    OSError
        If the file cannot be written.
    """
    where = Path(path)
    writer = _writer(where)
    strip = of_result(history, frames, until)
    with in_style(), whole(where, where.suffix) as aside:
        stage = _Stage(strip, curve, history)
        with writer.saving(stage.figure, str(aside), dpi=100):
            for frame in progress(range(len(strip.time))):
                stage.show(frame)
                writer.grab_frame()
    return where


def stills(history: History, instants: Any, titles: Any = ()) -> Any:
    """The ribbon at some instants (s), side by side in perspective, as the paper's Fig. 2 shows shapes."""
    instants = np.atleast_1d(np.asarray(instants, dtype=float))
    columns = len(instants)
    strips = [of_motion(history, 2, until=float(instant)) for instant in instants]
    points = np.concatenate([strip.edges[-1].reshape(-1, 3) for strip in strips])
    with in_style():
        fig = blank(2.9 * columns, 2.6, layout=_as_placed())
        for k, strip in enumerate(strips):
            axes = fig.add_subplot(1, columns, k + 1, projection="3d")
            fit(axes, points)
            x, y, z = np.moveaxis(strip.edges[-1], -1, 0)
            up = strip.normal[-1, :, 2] > 0.0
            axes.plot_surface(
                x,
                y,
                z,
                facecolors=np.where(up[None, :], _FACE, _BACK),
                rstride=1,
                cstride=2,
                lw=0,
                antialiased=False,
                clip_on=False,
            )
            level = state_name(float(strip.height[-1]), float(strip.slope[-1]))
            axes.set_title(titles[k] if k < len(titles) else level, fontsize=9)
    return fig
