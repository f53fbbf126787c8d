"""What is to be explored, and with which robot: the options of every environment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.envs.site import Site, site_of
from sim.errors import SimError
from sim.realism import read_realism
from worlds.splits import MapName, map_names

ROBOTS = ("kinematic", "sim", "ev3")
POSES = ("truth", "odometry", "slam")
HOMES = ("wait", "drive")


@dataclass(frozen=True, slots=True)
class Task:
    """The options of an environment.

    Raises:
        SimError, WorldError: one of them cannot be; the message says what can.
    """

    robot: str = "kinematic"
    """`kinematic`, `sim`, or `ev3`: the real robot, or its emulators."""
    pose: str = "truth"
    """What the map is made with: the true pose, which only a twin has, wheel odometry, or the pipeline `lidar_slam`."""
    world: str = ""
    """One world, as everywhere; empty: the maps of a split. A real robot takes none."""
    split: str = "train"
    """`train`, `validation` or `test`."""
    difficulty: str = ""
    """`easy`, `medium` or `complex`; empty: all."""
    family: str = ""
    """One family of maps; empty: all."""
    realism: str = ""
    """How imperfect the twin is; empty: `ideal` for `kinematic`, `datasheet` for `sim`."""
    native: bool = True
    """Step an ideal kinematic twin with a true pose by its kernel; the results are the same to the bit, ten times as fast."""
    goal: float = 0.99
    """Share of the area after which an episode ends."""
    steps: int = 3000
    """Length of an episode that `time` counts down from: what `gymnasium.make` is given as `max_episode_steps`."""
    home: str = "wait"
    """Between episodes a real robot waits for the operator, or drives home."""
    ev3: str = "usb"
    """Where the brick is, as in `twin run`."""
    lidar: str = "/dev/ttyACM0"
    """Where the lidar is, as in `twin run`."""

    def __post_init__(self) -> None:
        for option, known in (("robot", ROBOTS), ("pose", POSES), ("home", HOMES)):
            value = getattr(self, option)
            if value not in known:
                raise SimError(f"no {option} '{value}'; available: {', '.join(known)}")
        if not 0.0 < self.goal <= 1.0:
            raise SimError(f"the goal is a share of the area, above 0 and at most 1, got {self.goal}")
        if self.steps < 1:
            raise SimError(f"an episode has 1 step or more, got {self.steps}")
        if self.robot == "ev3":
            self._check_real()
            return
        object.__setattr__(self, "realism", self.realism or ("ideal" if self.robot == "kinematic" else "datasheet"))
        read_realism(self.realism)
        if not self.world:
            self.names()

    @property
    def is_native(self) -> bool:
        """Whether the kernel may stand for the robot."""
        return self.native and (self.robot, self.pose, self.realism) == ("kinematic", "truth", "ideal")

    def names(self) -> list[MapName]:
        """The maps that an episode's is drawn from.

        Raises:
            SplitError: the split, the difficulty or the family does not exist.
        """
        return map_names(self.split, self.difficulty, self.family)

    def site(self, random: np.random.Generator, world: str = "") -> Site:
        """The site of the next episode: the one named, the task's own, or one drawn."""
        text = world or self.world
        if not text:
            names = self.names()
            text = names[int(random.integers(len(names)))].text
        return site_of(text)

    def _check_real(self) -> None:
        """What a real robot cannot."""
        if self.pose == "truth":
            raise SimError("a real robot has no true pose; take pose='odometry' or pose='slam'")
        for option in ("world", "realism"):
            if getattr(self, option):
                raise SimError(f"a real robot takes no {option}, got '{getattr(self, option)}'")
