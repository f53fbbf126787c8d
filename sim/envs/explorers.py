"""Explorers to compare an agent with, from driving at random to one that is told the truth."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim.envs import area_kernel, tour_kernel
from sim.envs.driving import DIRECTIONS, Driver, Driving
from sim.envs.explore import ExploreEnv
from sim.envs.map_kernel import CELL, HALF
from sim.envs.native import BEAMS
from slam.kernels import outlook
from slam.messages import Twist
from slam.navigation.frontiers import STRATEGIES, Frontier

TRIES = 3
"""How often a frontier may be gone to in vain."""
SAMPLES = 40
"""Places that next-best-view weighs."""
DECAY = 0.25
"""How fast a view loses its worth with the way to it [1/m]."""
RAYS = 180
LOOK = 112
"""Reach of a view [cells]."""
Choice = Callable[["Driver", Sequence[Frontier]], Frontier | None]


class Explorer(Protocol):
    """Decides and drives, once a call."""

    def act(self) -> bool:
        """Make one decision and carry it out; False: there is nothing left to do."""
        ...


class RandomDriver:
    """Holds a speed and a yaw rate drawn at random for a second."""

    def __init__(self, env: ExploreEnv, random: np.random.Generator) -> None:
        self._env, self._random = env, random

    def act(self) -> bool:
        """See `Explorer`."""
        v, omega = self._random.uniform((-0.1, -1.5), (0.35, 1.5)).tolist()
        for _ in range(10):
            self._env.advance(Twist(v, omega))
        return True


class Wanderer:
    """Drives on while there is room ahead; else turns away, by as much as luck has it."""

    def __init__(self, env: ExploreEnv, random: np.random.Generator) -> None:
        self._env, self._random = env, random

    def act(self) -> bool:
        """See `Explorer`."""
        scan: NDArray[np.float32] = self._env.body.sight.scan[0]
        middle = BEAMS // 2
        if free_ahead(scan) > 0.25:
            drift = 0.4 * float(np.mean(scan[middle:]) - np.mean(scan[: middle + 1])) / max(float(scan.mean()), 0.1)
            self._env.advance(Twist(0.3, drift))
            return True
        side = math.copysign(1.2, float(np.mean(scan[middle:]) - np.mean(scan[: middle + 1])))
        for _ in range(int(self._random.integers(5, 20))):
            self._env.advance(Twist(0.0, side))
        return True


class WallFollower:
    """Keeps the wall on its right."""

    def __init__(self, env: ExploreEnv, random: np.random.Generator) -> None:
        self._env = env

    def act(self) -> bool:
        """See `Explorer`."""
        scan = self._env.body.sight.scan[0]
        right, before = float(np.min(scan[12:42])), float(np.min(scan[42:66]))
        if free_ahead(scan) < 0.2:
            self._env.advance(Twist(0.0, 1.2))
        elif right > 0.8 and before > 0.8:
            self._env.advance(Twist(0.2, -0.8))
        else:
            self._env.advance(Twist(0.2, max(-1.0, min(1.0, 2.5 * (0.35 - min(right, 0.8 * before))))))
        return True


def free_ahead(scan: NDArray[np.float32]) -> float:
    """Length of the way straight ahead that a robot has free (BEAMS,) [m]."""
    x, y = scan * DIRECTIONS[:, 0], scan * DIRECTIONS[:, 1]
    return float(np.min(x[(np.abs(y) < 0.19) & (x > 0.0)], initial=10.0)) - 0.15


class FrontierExplorer:
    """Goes from frontier to frontier, as a choice among them says; none is gone to in vain for ever."""

    def __init__(self, env: ExploreEnv, choice: Choice) -> None:
        self._env, self._choice = env, choice
        self._driver = Driving().build(env)
        self._vain = Counter[tuple[int, int]]()

    def act(self) -> bool:
        """See `Explorer`."""
        frontiers = [frontier for frontier in self._driver.look() if self._vain[_near(frontier)] < TRIES]
        chosen = self._choice(self._driver, frontiers) if frontiers else None
        if chosen is None:
            return False
        tally = self._env.tally
        area, path = tally.area, tally.path
        self._driver.drive_to(chosen.viewpoint, chosen.point)
        if tally.area - area < 0.05 and tally.path - path < 0.2:
            self._vain[_near(chosen)] += 1
        return True


def _near(frontier: Frontier) -> tuple[int, int]:
    """The half metre in which a frontier lies."""
    return round(2.0 * frontier.point[0]), round(2.0 * frontier.point[1])


def by_strategy(strategy: str) -> Choice:
    """The frontier that a strategy of `slam.navigation.frontiers` thinks best."""
    settings = replace(Driving().explorer, strategy=strategy)
    return lambda driver, frontiers: settings.best(frontiers)


def next_best_view(random: np.random.Generator) -> Choice:
    """The place, of some drawn at random and of the frontiers' own, from which most of the unknown may be seen, for the way to it.

    Gonzalez-Banos, Latombe, "Navigation strategies for exploring indoor environments" (2002): gain times exp(-decay x way).
    """

    def choose(driver: Driver, frontiers: Sequence[Frontier]) -> Frontier | None:
        places = _places(driver, frontiers, random)
        assert driver.ways is not None
        gains = outlook.unknown_in_view(driver.ways.costmap.states, places, LOOK, LOOK, RAYS).astype(np.float64)
        return _best(driver, places, gains)

    return choose


def oracle(env: ExploreEnv, random: np.random.Generator) -> Choice:
    """As next-best-view, with what is to be seen told by the truth: how far choosing well could go, place by place."""
    site = env.site
    assert site is not None, "only a twin's place is known"
    truth, (first_row, first_col) = site.area, site.corner

    def choose(driver: Driver, frontiers: Sequence[Frontier]) -> Frontier | None:
        places = _places(driver, frontiers, random)
        assert driver.ways is not None
        geometry = driver.ways.costmap.geometry
        low = np.rint(np.array([geometry.T_map_grid.y, geometry.T_map_grid.x]) / CELL).astype(np.int64) + HALF
        height, width = truth.shape
        unseen = (truth > 0) & (env.body.cells[first_row : first_row + height, first_col : first_col + width] == 0)
        gains = area_kernel.unseen_in_view((truth == 0).astype(np.uint8), unseen, places + low - (first_row, first_col), float(LOOK), RAYS)
        return _best(driver, places, gains.astype(np.float64))

    return choose


def tour_of_frontiers(driver: Driver, frontiers: Sequence[Frontier]) -> Frontier | None:
    """The first stop of a short tour through all frontiers: from the robot the way is the real one, between frontiers the straight one."""
    points = np.array([frontier.viewpoint for frontier in frontiers])
    lengths = np.linalg.norm(points[:, None] - points, axis=2)
    ways = np.array([frontier.way for frontier in frontiers])
    return frontiers[int(tour_kernel.tour(ways, lengths)[0])]


def _places(driver: Driver, frontiers: Sequence[Frontier], random: np.random.Generator) -> NDArray[np.int64]:
    """Cells (N, 2) that the robot can get to: those to see the frontiers from, and some drawn at random."""
    assert driver.ways is not None
    reached = np.argwhere(np.isfinite(driver.ways.lengths))
    drawn = reached[random.integers(len(reached), size=SAMPLES)]
    own = driver.ways.costmap.geometry.to_cells(np.array([frontier.viewpoint for frontier in frontiers]))
    return np.vstack([own, drawn])


def _best(driver: Driver, places: NDArray[np.int64], gains: NDArray[np.float64]) -> Frontier | None:
    """The place with the greatest gain for its way; None where no place promises anything."""
    assert driver.ways is not None
    ways = driver.ways.lengths[places[:, 0], places[:, 1]] * CELL
    best = int(np.argmax(gains * np.exp(-DECAY * ways)))
    if gains[best] <= 0.0:
        return None
    x, y = driver.ways.costmap.geometry.to_points(places[best : best + 1])[0].tolist()
    return Frontier((x, y), (x, y), 0.0, float(ways[best]), float(gains[best]) * CELL * CELL)


EXPLORERS: dict[str, Callable[[ExploreEnv, np.random.Generator], Explorer]] = {
    "random": RandomDriver,
    "wander": Wanderer,
    "wall_follow": WallFollower,
    **{name: lambda env, random, name=name: FrontierExplorer(env, by_strategy(name)) for name in STRATEGIES},
    "next_best_view": lambda env, random: FrontierExplorer(env, next_best_view(random)),
    "tsp": lambda env, random: FrontierExplorer(env, tour_of_frontiers),
    "oracle": lambda env, random: FrontierExplorer(env, oracle(env, random)),
}
"""name -> what makes it for an episode that has begun; it draws from a generator of its own."""
