"""What the scans tell of the pose, drawn into the map: the eigen-directions of the dynamic localizability matrix D."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from PIL import ImageDraw

from scripts.runs import palette
from scripts.runs.record import KeyFrame
from slam.se2 import SE2, FloatArray

MAGNIFIED = 40.0
"""So many times a standard deviation is half the length of its cross's bar."""
LONGEST = 0.8
"""Half the length of a bar along a direction of which a scan tells nothing [m]."""
CROSSES = 24
"""Most of them in a picture of a whole run."""


def crosses(frames: Sequence[KeyFrame], T_world_map: SE2) -> FloatArray:
    """Bars (K, 2, 2) [m] in the world: at each moment two across each other, the longer the less the scan knows of that direction."""
    bars = [bar for frame in frames for bar in _cross(frame)]
    return T_world_map.transform(np.array(bars).reshape(-1, 2)).reshape(-1, 2, 2)


def draw_crosses(axes: Axes, frames: Sequence[KeyFrame], T_world_map: SE2) -> None:
    """Draw those of a run, evenly spread."""
    told = [frame for frame in frames if frame.localizability.any()]
    bars = crosses(told[:: 1 + len(told) // CROSSES], T_world_map)
    axes.add_collection(LineCollection(list(bars), colors=palette.INK, linewidths=1.2, alpha=0.7, zorder=4))


def draw_cross(draw: ImageDraw.ImageDraw, ends: Sequence[tuple[float, float]], width: int) -> None:
    """Draw a cross, given as the ends of its bars one after the other [px]."""
    for first, last in zip(ends[::2], ends[1::2], strict=True):
        draw.line((first, last), fill=palette.INK, width=width)


def _cross(frame: KeyFrame) -> Iterator[FloatArray]:
    D = frame.localizability
    if not D.any():
        return
    place = D[:2, :2] - np.outer(D[:2, 2], D[:2, 2]) / D[2, 2] if D[2, 2] > 0.0 else D[:2, :2]
    values, directions = np.linalg.eigh(place)
    middle = np.array([frame.T_map_base.x, frame.T_map_base.y])
    for value, direction in zip(values.tolist(), directions.T, strict=True):
        half = LONGEST if value <= (MAGNIFIED / LONGEST) ** 2 else MAGNIFIED / np.sqrt(value)
        yield np.array([middle - half * direction, middle + half * direction])
