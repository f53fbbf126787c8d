"""`markers.png` and `markers.gif`: what the camera saw with axes on each marker, and the marker map in space."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from scripts.runs import palette
from scripts.runs.files import write_via
from scripts.runs.marker_views import MarkerView
from slam.landmarks.marker_map import MappedMarker, MarkerMap
from slam.messages import Trajectory
from slam.se2 import FloatArray
from slam.se3 import SE3

SIZE = (720, 480)
"""Of the map's picture [px]."""
FINE = 2
"""Everything is drawn this much larger and averaged."""
HEADER, MARGIN = 34, 28
ELEVATION = math.radians(32.0)
AZIMUTHS = math.radians(-70.0), math.radians(-20.0)
"""From where the map is seen, at the run's beginning and at its end."""
AXES = (palette.SCAN, palette.TRUTH, palette.ESTIMATE)
"""Of x, y and z."""
FRUSTUM = 0.25 * np.array([[0.0, 0.0, 0.0], [-0.7, -0.4, 1.0], [0.7, -0.4, 1.0], [0.7, 0.4, 1.0], [-0.7, 0.4, 1.0]])
EDGES = ((0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4), (4, 1))
FRAME_MS, LAST_FRAME_MS = 140, 1800
COLOURS = 96


@dataclass(frozen=True, slots=True, eq=False)
class Outlook:
    """A view of space from far away."""

    turn: FloatArray
    """(2, 3) right and up in the picture."""
    scale: float
    """[px/m]"""
    middle: FloatArray
    """(2,) of what is shown, along the picture's axes [m]."""

    @classmethod
    def over(cls, points: FloatArray, azimuth: float) -> Outlook:
        """From an azimuth [rad], so that points (N, 3) fill the picture whatever the azimuth."""
        c, s, e = math.cos(azimuth), math.sin(azimuth), ELEVATION
        turn = np.array([[-s, c, 0.0], [-c * math.sin(e), -s * math.sin(e), math.cos(e)]])
        low, high = points.min(axis=0), points.max(axis=0)
        across = float(np.hypot(*(high - low)[:2]))
        upright = across * math.sin(e) + float(high[2] - low[2]) * math.cos(e)
        scale = FINE * min((SIZE[0] - 2 * MARGIN) / max(across, 0.5), (SIZE[1] - 2 * MARGIN) / max(upright, 0.5))
        return cls(turn, scale, turn @ (0.5 * (low + high)))

    def pixels(self, points: FloatArray) -> list[tuple[float, float]]:
        """Fine pixels of points (N, 3)."""
        right, up = (self.scale * (points @ self.turn.T - self.middle)).T
        return list(zip((0.5 * FINE * SIZE[0] + right).tolist(), (0.5 * FINE * SIZE[1] - up).tolist(), strict=True))


def write_marker_pictures(folder: Path, title: str, found: tuple[MarkerMap, Trajectory], views: Sequence[MarkerView]) -> None:
    """Write markers.png, the moment with most markers beside the whole map, and markers.gif, how it came about.

    Args:
        folder: of the run.
        title: of the pictures.
        found: the marker map and the robot's way in it.
        views: moments of the run, in order; at least one.

    Raises:
        OutputError: a file cannot be written.
    """
    best = max(views, key=lambda view: len(view.seen))
    whole = _page(title, best, _map_picture(found, views, best, AZIMUTHS[1], math.inf))
    write_via(folder / "markers.png", whole.save)
    azimuths = np.linspace(*AZIMUTHS, len(views)).tolist()
    pages = [
        _page(title, view, _map_picture(found, views, view, azimuth, view.stamp)) for view, azimuth in zip(views, azimuths, strict=True)
    ]
    colours = pages[-1].quantize(COLOURS, dither=Image.Dither.NONE)
    frames = [page.quantize(palette=colours, dither=Image.Dither.NONE) for page in pages]
    durations = [FRAME_MS] * (len(frames) - 1) + [LAST_FRAME_MS]
    write_via(
        folder / "markers.gif", lambda partial: frames[0].save(partial, save_all=True, append_images=frames[1:], duration=durations, loop=0)
    )


def _map_picture(
    found: tuple[MarkerMap, Trajectory], views: Sequence[MarkerView], now: MarkerView, azimuth: float, until: float
) -> Image.Image:
    """The map in space as far as it was seen until a time [s], with the camera and its sight lines at a moment."""
    markers, way = found[0].markers, found[1]
    path = np.column_stack([way.poses[:, :2], np.zeros(len(way))])
    outlook = Outlook.over(np.concatenate([*(marker.corners for marker in markers.values()), path, np.zeros((1, 3))]), azimuth)
    fine = Image.new("RGB", (FINE * SIZE[0], FINE * SIZE[1]), palette.PAGE)
    draw = ImageDraw.Draw(fine)
    driven = path[way.stamps <= until]
    if len(driven) > 1:
        draw.line(outlook.pixels(driven), fill=palette.ESTIMATE, width=2 * FINE, joint="curve")
    seen = {number for view in views if view.stamp <= until for number in view.seen}
    for marker in markers.values():
        _draw_marker(draw, outlook, marker, marker.id in seen)
    for number in now.seen:
        if number in markers:
            ray = np.array([now.T_map_camera.t, markers[number].T_map_marker.t])
            draw.line(outlook.pixels(ray), fill=palette.TRUTH_PALE, width=FINE)
    _draw_camera(draw, outlook, now.T_map_camera)
    return fine.reduce(FINE)


def _draw_marker(draw: ImageDraw.ImageDraw, outlook: Outlook, marker: MappedMarker, seen: bool) -> None:
    """Its square, and its axes once it has been seen."""
    draw.polygon(outlook.pixels(marker.corners), fill=palette.OCCUPIED if seen else palette.UNKNOWN)
    if seen:
        T = marker.T_map_marker
        for axis, colour in enumerate(AXES):
            tip = T.t + 1.2 * marker.size * T.R[:, axis]
            draw.line(outlook.pixels(np.array([T.t, tip])), fill=colour, width=2 * FINE)


def _draw_camera(draw: ImageDraw.ImageDraw, outlook: Outlook, T_map_camera: SE3) -> None:
    corners = outlook.pixels(T_map_camera.transform(FRUSTUM))
    for a, b in EDGES:
        draw.line([corners[a], corners[b]], fill=palette.ODOMETRY, width=2 * FINE)


def _page(title: str, view: MarkerView, space: Image.Image) -> Image.Image:
    """The camera's picture beside the map."""
    picture = Image.fromarray(view.picture)
    page = Image.new("RGB", (picture.width + space.width, HEADER + space.height), palette.PAGE)
    page.paste(space, (picture.width, HEADER))
    page.paste(picture, (0, HEADER + (space.height - picture.height) // 2))
    draw = ImageDraw.Draw(page)
    draw.text((14, 8), f"{title}: markers", fill=palette.INK, font=ImageFont.load_default(18))
    draw.text((page.width - 14, 10), f"{view.stamp:.1f} s", fill=palette.INK, font=ImageFont.load_default(16), anchor="ra")
    return page
