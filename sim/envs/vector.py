"""Many `Explore-v0` at once, for `gymnasium.make_vec`: one kernel steps all robots, on as many threads as there are processors."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from hardware.spec import DriveSpec
from sim.envs.explore import Observation, action_space, observation_space
from sim.envs.native import PERIOD, Fleet, Sight, quick_spec
from sim.envs.tally import AT_THE_GOAL, CELL_AREA, Tally
from sim.envs.task import Task
from sim.errors import SimError


class ExploreVectorEnv(VectorEnv[Observation, NDArray[np.float32], NDArray[Any]]):
    """Ideal kinematic twins with true poses, each to the bit as alone; options are those of `sim.envs.task.Task`.

    An episode that has ended begins anew with the next step, whose action does nothing (`AutoresetMode.NEXT_STEP`).
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 (Gymnasium's own type)

    def __init__(self, num_envs: int = 1, max_episode_steps: int = 3000, threads: int = 0, **options: Any) -> None:  # noqa: ANN401 (as `Task` has them)
        """Make them ready.

        Args:
            num_envs: how many.
            max_episode_steps: after which an episode is cut off.
            threads: that step them; 0: one for each processor.
            options: see `Task`.

        Raises:
            SimError: an option cannot be, or asks for what the kernel does not do.
        """
        wanted: dict[str, Any] = {"steps": max_episode_steps, **options}
        self.task = Task(**wanted)
        if not self.task.is_native:
            raise SimError("the vector environment steps ideal kinematic twins with pose='truth'; take vectorization_mode='sync'")
        if num_envs < 1:
            raise SimError(f"there must be 1 environment or more, got {num_envs}")
        self.num_envs = num_envs
        self.single_observation_space, self.single_action_space = observation_space(), action_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._limit, self._fastest = max_episode_steps, (DriveSpec().max_speed, DriveSpec().max_yaw_rate)
        self._fleet, self._sight = Fleet(num_envs, quick_spec()), Sight.empty(num_envs)
        self._tallies = [Tally(math.inf) for _ in range(num_envs)]
        self._randoms = [np.random.default_rng() for _ in range(num_envs)]
        self._over = np.zeros(num_envs, np.bool_)
        count = min(threads or os.cpu_count() or 1, num_envs)
        ends = [num_envs * k // count for k in range(count + 1)]
        self._spans = list(itertools.pairwise(ends))
        self._threads = ThreadPoolExecutor(count) if count > 1 else None

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode in every one; robot i has `seed + i`, as with Gymnasium's own vectors."""
        seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else seed or [None] * self.num_envs
        for i, own in enumerate(seeds):
            if own is not None:
                self._randoms[i] = np.random.Generator(np.random.PCG64(np.random.SeedSequence(own)))
            self._begin(i, (options or {}).get("world", ""))
        self._over[:] = False
        return self._observation(), self._info()

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[Observation, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Drive on for 0.1 s with actions (N, 2)."""
        rewards, ended, cut = np.zeros(self.num_envs), np.zeros(self.num_envs, np.bool_), np.zeros(self.num_envs, np.bool_)
        begun = self._over.copy()
        self._fleet.command(np.asarray(actions, np.float64) * self._fastest)
        self._advance(begun)
        for i in np.flatnonzero(~begun).tolist():
            rewards[i], ended[i] = self._settle(i)
            cut[i] = self._tallies[i].steps >= self._limit
        for i in np.flatnonzero(begun).tolist():
            self._begin(i)
        self._over = ended | cut
        return self._observation(), rewards, ended, cut, self._info()

    def close_extras(self, **kwargs: Any) -> None:  # noqa: ANN401 (Gymnasium's own signature)
        """Let go of the threads."""
        if self._threads is not None:
            self._threads.shutdown()

    def _advance(self, waiting: NDArray[np.bool_]) -> None:
        """Step all robots but those whose episode is over."""
        spans = self._spans
        if waiting.any():
            spans = [(i, i + 1) for i in np.flatnonzero(~waiting).tolist()]
        if self._threads is None or len(spans) < 2:
            for first, last in spans:
                self._fleet.step(self._sight, first, last)
        else:
            for done in [self._threads.submit(self._fleet.step, self._sight, first, last) for first, last in spans]:
                done.result()

    def _begin(self, i: int, world: str = "") -> None:
        """Put a robot at the start of its next site."""
        site = self.task.site(self._randoms[i], world)
        self._randoms[i].integers(1 << 31)  # the noise that an ideal robot does without
        self._fleet.place(i, site)
        self._fleet.step(self._sight, i, i + 1)
        self._tallies[i] = Tally(site.cells * CELL_AREA)
        self._tallies[i].begin(int(self._sight.gained[i]), self._place(i))

    def _settle(self, i: int) -> tuple[float, bool]:
        """Reward of a robot's step, and whether it has reached the goal."""
        tally = self._tallies[i]
        reward = tally.add(int(self._sight.gained[i]), self._place(i), bool(self._sight.contact[i]), PERIOD)
        done = tally.coverage >= self.task.goal
        return reward + AT_THE_GOAL * done, done

    def _place(self, i: int) -> tuple[float, float]:
        x, y, _ = self._sight.pose[i].tolist()
        return x, y

    def _observation(self) -> Observation:
        sight, poses = self._sight, self._sight.pose
        yaws = [(math.cos(yaw), math.sin(yaw)) for yaw in poses[:, 2].tolist()]
        left = [max(1.0 - tally.steps / self.task.steps, 0.0) for tally in self._tallies]
        return {
            "map": sight.view[:, None].copy(),
            "overview": sight.overview[:, None].copy(),
            "scan": sight.scan.copy(),
            "pose": np.column_stack([poses[:, :2], yaws]).astype(np.float32),
            "time": np.array(left, np.float32)[:, None],
        }

    def _info(self) -> dict[str, Any]:
        """The numbers of `Tally.info` (N,), and as Gymnasium has it which of them are there (N,)."""
        rows = [tally.info(PERIOD) for tally in self._tallies]
        known = np.ones(self.num_envs, np.bool_)
        columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        return {**columns, **{f"_{name}": known.copy() for name in columns}}
