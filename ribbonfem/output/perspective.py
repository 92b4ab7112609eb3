"""Limits and scale of 3D axes: one scale along all three, and the whole ribbon inside."""

from __future__ import annotations

from typing import Any

import numpy as np

from ribbonfem.results import Array

# L; a flat ribbon still has a box to be seen in
_LEAST = 0.15
# of a panel, what the ribbon fills of it at the most
_FILLED = 0.96


def box(axes: Any, points: Array) -> None:
    """Limits around points (n, 3), in L, and a box of their proportions: one scale along all axes."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * np.maximum(high - low, _LEAST)
    low, high = middle - half, middle + half
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    # as matplotlib has widened them
    axes.set_box_aspect(np.ptp(np.reshape(axes.get_w_lims(), (3, 2)), axis=1))
    # about perpendicular to the span
    axes.view_init(elev=18.0, azim=-75.0)


def fit(axes: Any, points: Array) -> None:
    """`box`, without axes, as large as the panel of the axes can hold it: nothing is cut at its sides."""
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    box(axes, points)
    axes.set_axis_off()
    panel = axes.get_position(original=True).transformed(axes.figure.transSubfigure)
    middle = 0.5 * (panel.p0 + panel.p1)
    aspect, zoom = np.ptp(np.reshape(axes.get_w_lims(), (3, 2)), axis=1), 1.0
    # (in perspective not quite in proportion to the zoom)
    for _ in range(4):
        axes.set_box_aspect(aspect, zoom=zoom)
        axes.apply_aspect()
        x, y, _depth = proj_transform(*points.T, axes.get_proj())
        away = np.abs(axes.transData.transform(np.column_stack((x, y))) - middle).max(axis=0)
        zoom *= _FILLED * float((0.5 * panel.size / away).min())
    axes.set_box_aspect(aspect, zoom=zoom)
