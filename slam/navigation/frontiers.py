"""Frontiers, where what is free borders on what is unknown, and which of them to go to next."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import ndimage

from slam.errors import UnknownNameError, require_not_negative, require_positive
from slam.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from slam.kernels import outlook
from slam.navigation.costmap import Costmap, Inflation
from slam.navigation.planner import Ways, ways_from
from slam.se2 import SE2, FloatArray

EIGHT = np.ones((3, 3), np.bool_)
PIECE = 0.8
"""Side of the lattice's squares [m]."""
BEAMS = 180
"""Of a look around by which the gain is told."""


@dataclass(frozen=True, slots=True)
class Frontier:
    """A stretch of the border, and the place to look at it from."""

    point: tuple[float, float]
    """Cell of the border that is nearest to the middle of the stretch, in the map [m]."""
    viewpoint: tuple[float, float]
    """A place near it that sees what lies behind it, in the map [m]."""
    length: float
    """Of the border [m]."""
    way: float
    """What the way to the viewpoint costs [m]."""
    gain: float = 0.0
    """Unknown area about the point that a look from there may show [m^2]."""


@dataclass(frozen=True, slots=True)
class Explorer:
    """Chooses the next frontier, from a map and a pose alone."""

    strategy: str = "nearest"
    """`nearest`, `utility` or `gain`, see `STRATEGIES`."""
    shortest: float = 0.3
    """Length of border below which a stretch is left alone [m]."""
    least_gain: float = 0.2
    """Area that a look must promise [m^2]."""
    around: float = 1.5
    """Distance from a frontier up to which unknown area is its gain: what lies farther is the gain of others [m]."""
    depth: float = 1.0
    """So far into the unknown a look is believed to go [m]."""
    near: float = 1.5
    """A stretch is looked at from within this distance [m]."""
    gain_scale: float = 1.0
    """Of the strategy `utility`: metres of way that a metre of border is worth."""
    decay: float = 0.25
    """Of the strategy `gain`: how fast a gain loses its worth with the way to it [1/m]."""
    inflation: Inflation = field(default_factory=Inflation)

    def __post_init__(self) -> None:
        if self.strategy not in STRATEGIES:
            raise UnknownNameError("explorer", self.strategy, sorted(STRATEGIES))
        require_positive(self, "around", "depth", "near")
        require_not_negative(self, "shortest", "least_gain", "gain_scale", "decay")

    def goal(self, grid: OccupancyGrid, pose: SE2) -> Frontier | None:
        """The frontier to go to next; None: the reachable area is explored."""
        return self.best(self.frontiers(ways_from(Costmap.of(grid, self.inflation), (pose.x, pose.y))))

    def best(self, frontiers: Sequence[Frontier]) -> Frontier | None:
        """The most promising of frontiers; None of none."""
        return max(frontiers, key=lambda frontier: STRATEGIES[self.strategy](self, frontier), default=None)

    def frontiers(self, ways: Ways, near: float | None = None) -> list[Frontier]:
        """All frontiers worth a look that can be reached.

        Args:
            ways: from where the robot is.
            near: distance to look from [m], instead of the settings'.
        """
        costmap, resolution = ways.costmap, ways.costmap.geometry.resolution
        found: list[tuple[float, tuple[int, int], tuple[int, int]]] = []
        for cells in borders(costmap, self.shortest):
            middle = _middle(cells)
            seen_from = outlook.viewpoint(ways.lengths, costmap.states, middle, (near or self.near) / resolution)
            if seen_from[0] >= 0:
                found.append((len(cells) * resolution, middle, seen_from))
        middles = np.array([middle for _, middle, _ in found], dtype=np.int64).reshape(-1, 2)
        gains = outlook.unknown_in_view(costmap.states, middles, self.around / resolution, self.depth / resolution, BEAMS)
        frontiers = [
            Frontier(
                _point(costmap, middle), _point(costmap, at), length, float(ways.lengths[at]) * resolution, float(gain) * resolution**2
            )
            for (length, middle, at), gain in zip(found, gains, strict=True)
        ]
        return [frontier for frontier in frontiers if frontier.gain >= self.least_gain]


def borders(costmap: Costmap, shortest: float) -> list[np.ndarray[tuple[int, int], np.dtype[np.int64]]]:
    """Free cells beside unknown ones, in pieces (N, 2) as (row, col): a border cut by a lattice, for the middle of a long one tells little.

    Yamauchi, "A frontier-based approach for autonomous exploration" (1997). Borders shorter than a length [m] are left out, and what lies
    in gaps of less than three cells: the holes of a wall that was seen at a grazing angle.
    """
    wide = ndimage.binary_opening(costmap.states != OCCUPIED, EIGHT)
    border = wide & (costmap.states == FREE) & ndimage.binary_dilation(wide & (costmap.states == UNKNOWN))
    areas, count = ndimage.label(border, EIGHT)
    long_enough = np.bincount(areas.ravel(), minlength=count + 1) * costmap.geometry.resolution >= shortest
    long_enough[0] = False
    cells = np.argwhere(long_enough[areas])
    blocks = cells // max(round(PIECE / costmap.geometry.resolution), 1)
    _, numbers = np.unique(np.column_stack([areas[cells[:, 0], cells[:, 1]], blocks]), axis=0, return_inverse=True)
    order = np.argsort(numbers.reshape(-1), kind="stable")
    ends = np.cumsum(np.bincount(numbers.reshape(-1)))
    return np.split(cells[order], ends[:-1]) if len(cells) else []


def _middle(cells: np.ndarray[tuple[int, int], np.dtype[np.int64]]) -> tuple[int, int]:
    off: FloatArray = cells - cells.mean(axis=0)
    row, col = cells[int(np.argmin(np.hypot(*off.T)))].tolist()
    return row, col


def _point(costmap: Costmap, cell: tuple[int, int]) -> tuple[float, float]:
    x, y = costmap.geometry.to_points(np.array([cell]))[0].tolist()
    return x, y


def _nearest(settings: Explorer, frontier: Frontier) -> float:
    """The shortest way: Yamauchi (1997)."""
    return -frontier.way


def _utility(settings: Explorer, frontier: Frontier) -> float:
    """Length of the border against the way to it, as ROS's explore_lite weighs them."""
    return settings.gain_scale * frontier.length - frontier.way


def _gain(settings: Explorer, frontier: Frontier) -> float:
    """Area to be seen, fading with the way to it.

    Gonzalez-Banos, Latombe, "Navigation strategies for exploring indoor environments" (2002).
    """
    return frontier.gain * math.exp(-settings.decay * frontier.way)


STRATEGIES: dict[str, Callable[[Explorer, Frontier], float]] = {"nearest": _nearest, "utility": _utility, "gain": _gain}
"""name -> worth of a frontier."""
