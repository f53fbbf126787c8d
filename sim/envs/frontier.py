"""`bricktwin/ExploreFrontier-v0`: choose where to look next; getting there is done."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from sim.envs.driving import Driver, Driving
from sim.envs.explore import ExploreEnv, Observation, observation_space
from sim.envs.native import PERIOD
from sim.envs.tally import AT_THE_GOAL
from slam.navigation.frontiers import Frontier

CHOICES = 16
"""Frontiers that can be chosen from: the nearest."""
FARTHEST, LONGEST, MOST = 100.0, 50.0, 100.0
"""Bounds of way [m], length [m] and gain [m^2]."""


class ExploreFrontierEnv(gymnasium.Env[Observation, np.int64]):
    """As `ExploreEnv`, with a frontier for an action; options are those of `sim.envs.task.Task`, its steps count choices."""

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 2}  # noqa: RUF012 (Gymnasium's own type)

    def __init__(self, render_mode: str | None = None, operator: Callable[[str], object] = input, **options: Any) -> None:  # noqa: ANN401 (as `Task` has them)
        """See `ExploreEnv`."""
        self._inner = ExploreEnv(render_mode, operator, **{"steps": 300, **options})
        self.render_mode = render_mode
        self._driver: Driver = Driving().build(self._inner)
        self._choices: Sequence[Frontier] = ()
        self._made = 0
        high = np.tile(np.array([FARTHEST, 1, 1, LONGEST, MOST], np.float32), CHOICES)
        low = np.tile(np.array([0, -1, -1, 0, 0], np.float32), CHOICES)
        own = {"frontiers": spaces.Box(low, high), "action_mask": spaces.MultiBinary(CHOICES)}
        self.observation_space = spaces.Dict({**observation_space().spaces, **own})
        self.action_space = spaces.Discrete(CHOICES)

    @property
    def driving(self) -> ExploreEnv:
        """The environment in which the drives are made."""
        return self._inner

    def action_masks(self) -> NDArray[np.bool_]:
        """Which choices there are (CHOICES,); sb3-contrib's name for it."""
        return np.arange(CHOICES) < len(self._choices)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict[str, Any]]:
        """See `ExploreEnv.reset`."""
        super().reset(seed=seed)
        observation, info = self._inner.reset(seed=int(self.np_random.integers(1 << 31)), options=options)
        self._driver = Driving().build(self._inner)
        self._made = 0
        self._look()
        return self._with_choices(observation), self._with_mask(info)

    def step(self, action: np.int64) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive towards a frontier until it is reached, something is in the way, or 4 s are over; a choice that there is not stands."""
        self._made += 1
        if 0 <= int(action) < len(self._choices):
            chosen = self._choices[int(action)]
            reward = self._driver.drive_to(chosen.viewpoint, chosen.point)
        else:
            reward = self._driver.stand()
        self._look()
        reached = self._inner.is_done
        done = reached or not self._choices
        observation, info = self._inner.observe(), self._inner.tally.info(PERIOD)
        return self._with_choices(observation), reward + AT_THE_GOAL * reached, done, False, self._with_mask(info)

    def render(self) -> NDArray[np.uint8] | None:
        """See `ExploreEnv.render`."""
        return self._inner.render()

    def close(self) -> None:
        """See `ExploreEnv.close`."""
        self._inner.close()

    def _look(self) -> None:
        self._choices = self._driver.look()[:CHOICES]

    def _with_choices(self, observation: Observation) -> Observation:
        rows = np.zeros((CHOICES, 5), np.float32)
        inverse = self._driver.pose.inverse()
        for row, frontier in zip(rows, self._choices, strict=False):
            x, y = inverse.transform(np.array([frontier.point]))[0].tolist()
            bearing = math.atan2(y, x)
            row[:] = (
                min(frontier.way, FARTHEST),
                math.cos(bearing),
                math.sin(bearing),
                min(frontier.length, LONGEST),
                min(frontier.gain, MOST),
            )
        time = np.array([max(1.0 - self._made / self._inner.task.steps, 0.0)], np.float32)
        return {**observation, "time": time, "frontiers": rows.reshape(-1), "action_mask": self.action_masks().astype(np.int8)}

    def _with_mask(self, info: dict[str, Any]) -> dict[str, Any]:
        return {**info, "action_mask": self.action_masks().astype(np.int8)}
