"""The robots behind an environment: what every one of them does, and the native one."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim.envs.native import Fleet, Sight, quick_spec
from sim.envs.site import Site
from slam.messages import Twist


class Body(Protocol):
    """One robot, from episode to episode."""

    @property
    def sight(self) -> Sight:
        """What it sees; of one robot."""
        ...

    @property
    def cells(self) -> NDArray[np.uint8]:
        """Its map (SIDE, SIDE), see `map_kernel`."""
        ...

    @property
    def true_way(self) -> NDArray[np.float64] | None:
        """T_world_base (3,) now; None where nobody knows."""
        ...

    def start(self, site: Site | None, seed: int) -> None:
        """Begin an episode: at the start, with a map that knows only the first scan; `site` is None for a real robot."""
        ...

    def step(self, twist: Twist) -> None:
        """Drive on for 0.1 s with a twist, within the limits, and see."""
        ...

    def close(self) -> None:
        """Stop and let go. May be called twice."""
        ...


class NativeBody:
    """An ideal kinematic twin with a true pose."""

    def __init__(self) -> None:
        self._fleet = Fleet(1, quick_spec())
        self.sight = Sight.empty(1)

    @property
    def cells(self) -> NDArray[np.uint8]:
        """See `Body`."""
        return self._fleet.cells[0]

    @property
    def true_way(self) -> NDArray[np.float64]:
        """See `Body`."""
        return self._fleet.way[0]

    def start(self, site: Site | None, seed: int) -> None:
        """See `Body`; nothing of it is drawn."""
        assert site is not None
        self._fleet.place(0, site)
        self._fleet.step(self.sight)

    def step(self, twist: Twist) -> None:
        """See `Body`."""
        self._fleet.command(np.array([[twist.v, twist.omega]]))
        self._fleet.step(self.sight)

    def close(self) -> None:
        """See `Body`."""
