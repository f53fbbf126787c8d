"""`bricktwin/Explore-v0`: drive a robot by speed and yaw rate until the whole place is mapped."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hardware.spec import DriveSpec, LidarSpec
from sim.envs.body import Body, NativeBody
from sim.envs.driving import drive_home
from sim.envs.hal_body import HalBody
from sim.envs.map_kernel import VIEW
from sim.envs.native import BEAMS, PERIOD
from sim.envs.picture import Picture
from sim.envs.site import Site
from sim.envs.tally import AT_THE_GOAL, CELL_AREA, Tally
from sim.envs.task import Task
from slam.messages import Twist

Observation = dict[str, Any]
FAR = 64.0
"""Bound of the pose's coordinates [m]."""


def observation_space() -> spaces.Dict:
    """What every agent sees: see docs/environments.md."""
    reach = LidarSpec().range_max
    return spaces.Dict(
        {
            "map": spaces.Box(0, 255, (1, VIEW, VIEW), np.uint8),
            "overview": spaces.Box(0, 255, (1, VIEW, VIEW), np.uint8),
            "scan": spaces.Box(0.0, reach, (BEAMS,), np.float32),
            "pose": spaces.Box(np.array([-FAR, -FAR, -1, -1], np.float32), np.array([FAR, FAR, 1, 1], np.float32)),
            "time": spaces.Box(0.0, 1.0, (1,), np.float32),
        }
    )


def action_space() -> spaces.Box:
    """Speed and yaw rate as shares of the robot's largest."""
    return spaces.Box(-1.0, 1.0, (2,), np.float32)


class ExploreEnv(gymnasium.Env[Observation, NDArray[Any]]):
    """One robot in one place after the other; options are those of `sim.envs.task.Task`."""

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": round(1.0 / PERIOD)}  # noqa: RUF012 (Gymnasium's own type)

    def __init__(self, render_mode: str | None = None, operator: Callable[[str], object] = input, **options: Any) -> None:  # noqa: ANN401 (as `Task` has them)
        """Make it ready; the world or the robot is opened by `reset`.

        Args:
            render_mode: `rgb_array` or None.
            operator: told what to do with a real robot between two episodes; returns when it is done.
            options: see `Task`.

        Raises:
            SimError, WorldError: an option cannot be.
        """
        self.render_mode = render_mode
        self.task = Task(**options)
        self.observation_space = observation_space()
        self.action_space = action_space()
        self._drive = DriveSpec()
        self._body = self._make_body(operator)
        self._site: Site | None = None
        self._tally = Tally(math.inf)
        self._picture: Picture | None = None

    @property
    def body(self) -> Body:
        """The robot behind it."""
        return self._body

    @property
    def site(self) -> Site | None:
        """Where the robot is; None of a real one."""
        return self._site

    @property
    def tally(self) -> Tally:
        """What the episode has come to."""
        return self._tally

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode; `options={"world": TEXT}` names the place.

        Raises:
            SimError, WorldError, HardwareError: it cannot begin.
        """
        super().reset(seed=seed)
        real = self.task.robot == "ev3"
        if isinstance(self._body, HalBody) and self._body.is_running and self.task.home == "drive" and real:
            self._body.is_home = drive_home(self)
        self._site = None if real else self.task.site(self.np_random, (options or {}).get("world", ""))
        noise = int(self.np_random.integers(1 << 31))
        self._body.start(self._site, noise)
        sight = self._body.sight
        self._tally = Tally(self._site.cells * CELL_AREA if self._site is not None else math.inf)
        self._tally.begin(int(sight.gained[0]), self._place())
        if self.render_mode == "rgb_array":
            self._picture = Picture(self._site)
            self._picture.follow(sight.pose[0])
        return self.observe(), self._info()

    def step(self, action: NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive on for 0.1 s with shares (2,) of the largest speed and yaw rate."""
        v, omega = float(action[0]), float(action[1])
        reward = self.advance(Twist(v * self._drive.max_speed, omega * self._drive.max_yaw_rate))
        done = self.is_done
        return self.observe(), reward + AT_THE_GOAL * done, done, False, self._info()

    def advance(self, twist: Twist) -> float:
        """Drive on for 0.1 s with a twist of `base`; returns the reward."""
        self._body.step(twist)
        sight = self._body.sight
        if self._picture is not None:
            self._picture.follow(sight.pose[0])
        return self._tally.add(int(sight.gained[0]), self._place(), bool(sight.contact[0]), PERIOD)

    @property
    def is_done(self) -> bool:
        """Whether the goal is reached."""
        return self._tally.coverage >= self.task.goal

    def render(self) -> NDArray[np.uint8] | None:
        """The map as far as it is known, the robot, its way and its scan, as a picture (H, W, 3)."""
        if self._picture is None:
            return None
        return self._picture.draw(self._body.cells, self._body.sight, self._tally)

    def close(self) -> None:
        """Stop the robot. May be called twice."""
        self._body.close()

    def _make_body(self, operator: Callable[[str], object]) -> Body:
        return NativeBody() if self.task.is_native else HalBody(self.task, operator)

    def _place(self) -> tuple[float, float]:
        way = None if self.task.pose == "truth" else self._body.true_way
        x, y = (self._body.sight.pose[0] if way is None else way)[:2].tolist()
        return x, y

    def observe(self) -> Observation:
        """New arrays: an agent may keep them."""
        sight = self._body.sight
        x, y, yaw = sight.pose[0].tolist()
        return {
            "map": sight.view.copy(),
            "overview": sight.overview.copy(),
            "scan": sight.scan[0].copy(),
            "pose": np.array([x, y, math.cos(yaw), math.sin(yaw)], np.float32),
            "time": np.array([max(1.0 - self._tally.steps / self.task.steps, 0.0)], np.float32),
        }

    def _info(self) -> dict[str, Any]:
        return self._tally.info(PERIOD)
