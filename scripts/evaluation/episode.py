"""One explorer in one place, from the start to the goal or the end of the time."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from scripts.evaluation.accuracy import accuracy
from sim.envs.explore import ExploreEnv
from sim.envs.explorers import EXPLORERS
from sim.envs.native import PERIOD
from slam.messages import Twist
from slam.se2 import FloatArray

EVERY = 10
"""Steps from point to point of a curve: 1 s."""


@dataclass(frozen=True)
class Trial:
    """What is to be run."""

    explorer: str
    world: str
    seed: int
    robot: str
    pose: str
    steps: int


@dataclass(frozen=True)
class Episode:
    """What came of it."""

    explorer: str
    world: str
    robot: str
    pose: str
    coverage: float
    path: float
    """[m]"""
    time: float
    """[s]"""
    collisions: int
    marks: dict[int, tuple[float, float]]
    """Share of the area [%] -> path [m] and time [s] when it was reached first."""
    curve: list[float]
    """Coverage at every second, held to the end of the time."""
    decision_ms: float
    """Median time that this thread was busy with a decision and all its steps; the one number that no seed repeats."""
    pose_error: float | None = None
    """Root mean square error of the positions that it believed in, after alignment [m]; None where they were the truth."""
    iou: float | None = None
    """Of the occupied cells with the walls that were in view, see `slam.evaluation.maps.iou`; None where the pose was the truth."""

    @property
    def area_under_curve(self) -> float:
        """Mean coverage over the time given."""
        return float(np.mean(self.curve))


class Recording(ExploreEnv):
    """An environment that keeps the curve and the way, and ends with the time."""

    def begin(self, trial: Trial) -> None:
        """Start the episode of a trial."""
        self._limit, self.curve = trial.steps, list[float]()
        self.believed, self.true = list[FloatArray](), list[FloatArray]()
        self.reset(seed=trial.seed, options={"world": trial.world})
        self.curve.append(self.tally.coverage)
        self._keep_way()

    def advance(self, twist: Twist) -> float:
        """See `ExploreEnv.advance`; when the time is over nothing happens any more."""
        if self.tally.steps >= self._limit or self.tally.coverage >= self.task.goal:
            return 0.0
        reward = super().advance(twist)
        if self.tally.steps % EVERY == 0:
            self.curve.append(self.tally.coverage)
        self._keep_way()
        return reward

    def _keep_way(self) -> None:
        way = None if self.task.pose == "truth" else self.body.true_way
        if way is not None:
            self.believed.append(self.body.sight.pose[0].copy())
            self.true.append(way)


def run(trial: Trial) -> Episode:
    """Run a trial to its end."""
    env = Recording(robot=trial.robot, pose=trial.pose, world=trial.world, goal=0.995, steps=trial.steps)
    try:
        env.begin(trial)
        explorer = EXPLORERS[trial.explorer](env, np.random.default_rng((trial.seed, 1)))
        decisions: list[float] = []
        while env.tally.steps < trial.steps and not env.is_done:
            began = time.thread_time()
            if not explorer.act():
                break
            decisions.append((time.thread_time() - began) * 1e3)
        return _episode(trial, env, decisions)
    finally:
        env.close()


def _episode(trial: Trial, env: Recording, decisions: list[float]) -> Episode:
    tally, points = env.tally, trial.steps // EVERY + 1
    site = env.site
    assert site is not None, "a twin is somewhere"
    pose_error, overlap = accuracy(np.array(env.believed), np.array(env.true), env.body.cells, site) if env.believed else (None, None)
    return Episode(
        trial.explorer,
        trial.world,
        trial.robot,
        trial.pose,
        tally.coverage,
        tally.path,
        tally.steps * PERIOD,
        tally.collisions,
        dict(tally.marks),
        [*env.curve, *[tally.coverage] * (points - len(env.curve))][:points],
        float(np.median(decisions)) if decisions else 0.0,
        pose_error,
        overlap,
    )
