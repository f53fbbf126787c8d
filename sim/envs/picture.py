"""What an environment shows: the map as it grows, the robot, its way and its scan."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from sim.envs.map_kernel import CELL, FREEST, HALF
from sim.envs.native import BEAMS, FIELD, Sight
from sim.envs.site import Site
from sim.envs.tally import Tally

Image = NDArray[np.uint8]
Point = tuple[int, int]
WIDTH, HEIGHT, BAR = 720, 720, 56
"""Of the picture and of the bar above it [px]."""
SHIFT = 4
"""Sixteenths of a pixel, for smooth lines."""
MARGIN = 0.5
"""Around the place [m]."""
NIGHT, FLOOR, WALL, HIDDEN = (30, 34, 46), (236, 232, 222), (122, 132, 160), (52, 58, 76)
BEAM, TRAIL, BODY, NOSE = (255, 178, 62), (58, 134, 255), (239, 71, 111), (255, 255, 255)
INK, DONE, REST = (236, 232, 222), (6, 214, 160), (60, 66, 84)
REACH = 6.0
"""To each side of the start where the place is not known [m]."""


class Picture:
    """Draws one episode."""

    def __init__(self, site: Site | None) -> None:
        self._low, self._scale = _frame(site)
        self._hidden = _walls(site)
        self._trail: list[tuple[float, float]] = []

    def follow(self, pose: NDArray[np.float64]) -> None:
        """Keep a place (x, y, yaw) of the way, in the map."""
        self._trail.append((float(pose[0]), float(pose[1])))

    def draw(self, cells: NDArray[np.uint8], sight: Sight, tally: Tally) -> Image:
        """The picture (HEIGHT + BAR, WIDTH, 3) at a map (SIDE, SIDE)."""
        image = self._floor(cells)
        for wall in self._hidden:
            ends = [self._pixel(x, y) for x, y in wall.reshape(2, 2).tolist()]
            cv2.line(image, ends[0], ends[1], HIDDEN, 1, cv2.LINE_AA, SHIFT)
        image = np.where(self._is_known(cells)[..., None], self._floor(cells), image)
        self._draw_scan(image, sight)
        if len(self._trail) > 1:
            way = np.array([self._pixel(x, y) for x, y in self._trail], np.int32)
            cv2.polylines(image, [way], False, TRAIL, 2, cv2.LINE_AA, SHIFT)
        self._draw_robot(image, sight)
        return np.vstack([_bar(tally), image])

    def _floor(self, cells: NDArray[np.uint8]) -> Image:
        known = self._sampled(cells)
        colours = np.array([NIGHT, *[FLOOR] * FREEST, *[WALL] * (16 - FREEST - 1)], np.uint8)
        return colours[known]

    def _is_known(self, cells: NDArray[np.uint8]) -> NDArray[np.bool_]:
        return self._sampled(cells) > 0

    def _sampled(self, cells: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The cell under the middle of each pixel (HEIGHT, WIDTH)."""
        across = (self._low[0] + (np.arange(WIDTH) + 0.5) / self._scale) / CELL + HALF
        up = (self._low[1] + (HEIGHT - 0.5 - np.arange(HEIGHT)) / self._scale) / CELL + HALF
        limit = len(cells) - 1
        return cells[np.ix_(np.clip(up, 0, limit).astype(np.int64), np.clip(across, 0, limit).astype(np.int64))]

    def _draw_scan(self, image: Image, sight: Sight) -> None:
        x, y, yaw = sight.pose[0].tolist()
        angles = yaw + np.linspace(-0.5 * FIELD, 0.5 * FIELD, BEAMS)
        ends = np.column_stack([x + sight.scan[0] * np.cos(angles), y + sight.scan[0] * np.sin(angles)])
        fan = np.array([self._pixel(x, y), *(self._pixel(a, b) for a, b in ends.tolist())], np.int32)
        light = image.copy()
        cv2.fillPoly(light, [fan], BEAM, cv2.LINE_AA, SHIFT)
        cv2.addWeighted(light, 0.22, image, 0.78, 0.0, image)
        for a, b in ends[sight.scan[0] < 5.5].tolist():
            cv2.circle(image, self._pixel(a, b), 2 << SHIFT, BEAM, -1, cv2.LINE_AA, SHIFT)

    def _draw_robot(self, image: Image, sight: Sight) -> None:
        x, y, yaw = sight.pose[0].tolist()
        radius = int(0.13 * self._scale * (1 << SHIFT))
        cv2.circle(image, self._pixel(x, y), radius, BODY, -1, cv2.LINE_AA, SHIFT)
        nose = self._pixel(x + 0.13 * math.cos(yaw), y + 0.13 * math.sin(yaw))
        cv2.line(image, self._pixel(x, y), nose, NOSE, 2, cv2.LINE_AA, SHIFT)

    def _pixel(self, x: float, y: float) -> Point:
        """Of a place in the map, in sixteenths of a pixel."""
        column, row = (x - self._low[0]) * self._scale - 0.5, HEIGHT - 0.5 - (y - self._low[1]) * self._scale
        return round(column * (1 << SHIFT)), round(row * (1 << SHIFT))


def _frame(site: Site | None) -> tuple[tuple[float, float], float]:
    """Lowest x and y [m] that are shown, and pixels to a metre."""
    if site is None:
        return (-REACH, -REACH), WIDTH / (2.0 * REACH)
    ends = _walls(site).reshape(-1, 2)
    low, high = ends.min(axis=0) - MARGIN, ends.max(axis=0) + MARGIN
    scale = min(WIDTH / (high[0] - low[0]), HEIGHT / (high[1] - low[1]))
    middle = 0.5 * (low + high)
    return (float(middle[0] - 0.5 * WIDTH / scale), float(middle[1] - 0.5 * HEIGHT / scale)), float(scale)


def _walls(site: Site | None) -> NDArray[np.float64]:
    """Outlines (N, 4) [m] in the map."""
    if site is None:
        return np.empty((0, 4))
    return site.T_world_map.inverse().transform(site.walls[0].reshape(-1, 2)).reshape(-1, 4)


def _bar(tally: Tally) -> Image:
    """How far the episode is."""
    bar = np.full((BAR, WIDTH, 3), NIGHT, np.uint8)
    text = f"{tally.area:.1f} m2   {tally.path:.1f} m driven   {0.1 * tally.steps:.0f} s"
    text += f"   {tally.collisions} bumps" if tally.collisions else ""
    cv2.putText(bar, text, (16, 22), cv2.FONT_HERSHEY_DUPLEX, 0.55, INK, 1, cv2.LINE_AA)
    if math.isfinite(tally.whole):
        share = f"{100.0 * tally.coverage:.0f} %"
        cv2.putText(bar, share, (WIDTH - 70, 22), cv2.FONT_HERSHEY_DUPLEX, 0.6, DONE, 1, cv2.LINE_AA)
        cv2.rectangle(bar, (16, 36), (WIDTH - 16, 44), REST, -1)
        cv2.rectangle(bar, (16, 36), (16 + int((WIDTH - 32) * min(tally.coverage, 1.0)), 44), DONE, -1)
    return bar
