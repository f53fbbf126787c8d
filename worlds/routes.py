"""Ways through the free space of a world: shortest ones that keep clear, and round trips."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from worlds.parts import FloatArray, Point
from worlds.raster import Raster

STRIDE = 2
"""Every second cell is a place to be."""
COMFORT = 0.6
"""With less room than this around it [m] a step counts up to twice its length."""
LONGEST_STRETCH = 100
"""Steps from corner to corner of a way at most."""
_STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))


class Routes:
    """The graph of all places with room around them."""

    def __init__(self, raster: Raster, clearance: float) -> None:
        self._raster = raster
        self._clearance = clearance
        self._places = np.argwhere(raster.clearance[::STRIDE, ::STRIDE] >= clearance) * STRIDE
        self._points = raster.points(self._places)
        self._graph = self._steps()
        self._trees: dict[int, tuple[FloatArray, NDArray[np.int32]]] = {}

    @property
    def points(self) -> FloatArray:
        """Places (N, 2) [m]."""
        return self._points

    def nearest(self, point: Point) -> int:
        """The place that is nearest to a point.

        Raises:
            ValueError: there is no place at all.
        """
        return int(np.argmin(np.linalg.norm(self._points - np.array(point), axis=1)))

    def lengths(self, origin: int) -> FloatArray:
        """Lengths (N,) of the ways [m] from one place to all, tight stretches counted up to twice; inf where there is none."""
        return self._tree(origin)[0]

    def way(self, origin: int, goal: int) -> list[Point]:
        """Corners of a short way from place to place, both included; only the goal where there is none."""
        before = self._tree(origin)[1]
        steps = [goal]
        while before[steps[-1]] >= 0:
            steps.append(int(before[steps[-1]]))
        return self._straightened(self._points[steps[::-1]])

    def round_trip(self, start: Point, stops: int, reach: float) -> list[Point]:
        """Corners of a closed way from `start` by `stops` places far apart, within `reach` [m]; empty where it is shut in."""
        if not len(self._points):
            return []
        chosen = [self.nearest(start)]
        lengths = [self.lengths(chosen[0])]
        for _ in range(stops):
            near = np.where(lengths[0] <= reach, np.min(lengths, axis=0), 0.0)
            if near.max() < 1.0:
                break
            chosen.append(int(np.argmax(near)))
            lengths.append(self.lengths(chosen[-1]))
        order = _short_round([[float(row[place]) for place in chosen] for row in lengths])
        return self.through([chosen[i] for i in order])

    def through(self, places: list[int]) -> list[Point]:
        """Corners of the closed way through places in turn; the first is not repeated at the end."""
        corners: list[Point] = []
        for origin, goal in zip(places, (*places[1:], places[0]), strict=True):
            if origin != goal:
                corners.extend(self.way(origin, goal)[:-1])
        return corners

    def _tree(self, origin: int) -> tuple[FloatArray, NDArray[np.int32]]:
        """Length of the way to each place, and the place before it."""
        if origin not in self._trees:
            self._trees[origin] = csgraph.dijkstra(self._graph, directed=False, indices=np.array(origin), return_predecessors=True)
        return self._trees[origin]

    def _steps(self) -> sparse.csr_array:
        shape = tuple(math.ceil(n / STRIDE) for n in self._raster.clearance.shape)
        numbers = np.full((shape[0] + 2, shape[1] + 2), -1)
        numbers[tuple((self._places // STRIDE + 1).T)] = np.arange(len(self._places))
        room = self._raster.clearance[tuple(self._places.T)]
        costs = 1.0 + np.clip(1.0 - room / COMFORT, 0.0, 1.0)
        edges: list[tuple[NDArray[np.int64], NDArray[np.int64], FloatArray]] = []
        for down, right in _STEPS:
            rows, cols = (self._places // STRIDE + 1 + [down, right]).T
            to = numbers[rows, cols]
            origin = np.flatnonzero(to >= 0)
            length = math.hypot(down, right) * STRIDE * self._raster.cell
            edges.append((origin, to[origin], length * np.maximum(costs[origin], costs[to[origin]])))
        origins, goals, lengths = (np.concatenate(column) for column in zip(*edges, strict=True))
        return sparse.csr_array((lengths, (origins, goals)), shape=(len(self._places), len(self._places)))

    def _straightened(self, points: FloatArray) -> list[Point]:
        """The corners of a way that are left when each stretch goes as far as it keeps clear."""
        corners, at = [0], 0
        while at < len(points) - 1:
            beyond = range(min(at + LONGEST_STRETCH, len(points) - 1), at, -1)
            at = next((i for i in beyond if self._clear(points[at], points[i])), at + 1)
            corners.append(at)
        return [(round(float(x), 3), round(float(y), 3)) for x, y in points[corners]]

    def _clear(self, a: FloatArray, b: FloatArray) -> bool:
        count = math.ceil(float(np.linalg.norm(b - a)) / (0.5 * self._raster.cell)) + 1
        return bool(np.all(self._raster.room_at(np.linspace(a, b, count)) >= self._clearance))


def _short_round(lengths: list[list[float]]) -> list[int]:
    """Order of a short round through all places: each next the nearest, then stretches are turned round while that helps (2-opt)."""
    order, left = [0], set(range(1, len(lengths)))
    while left:
        order.append(min(left, key=lambda place: (lengths[order[-1]][place], place)))
        left.remove(order[-1])
    improved = True
    while improved:
        improved = False
        for i in range(1, len(order) - 1):
            for k in range(i + 1, len(order)):
                turned = [*order[:i], *order[i : k + 1][::-1], *order[k + 1 :]]
                if _length(turned, lengths) < _length(order, lengths) - 1e-9:
                    order, improved = turned, True
    return order


def _length(order: list[int], lengths: list[list[float]]) -> float:
    return sum(lengths[a][b] for a, b in zip(order, (*order[1:], order[0]), strict=True))
