"""Drives to a place over a map in the making: plans anew as the map changes, follows, and helps itself out."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from slam.errors import require_positive
from slam.messages import Estimate, SensorFrame, Twist
from slam.navigation.costmap import Costmap, Inflation
from slam.navigation.follower import Follower
from slam.navigation.planner import Ways, ways_from
from slam.navigation.surroundings import Memory, Surroundings
from slam.se2 import SE2, wrap_angle
from slam.snapshot import Snapshot

Point = tuple[float, float]


class Progress(StrEnum):
    """How a drive goes."""

    RESTING = "resting"
    """No goal."""
    DRIVING = "driving"
    ARRIVED = "arrived"
    FAILED = "failed"
    """No way, or one that stays blocked; the robot stands."""


@dataclass(frozen=True, slots=True)
class Navigation:
    """How a robot drives to a place."""

    inflation: Inflation = field(default_factory=Inflation)
    follower: Follower = field(default_factory=Follower)
    memory: Memory = field(default_factory=Memory)
    period: float = 1.0
    """Between two plans [s]; a jump of the map asks for one at once."""
    jump: float = 0.05
    """Correction of the map that is a jump [m]."""
    patience: float = 5.0
    """Time without progress after which the robot helps itself: it backs up, then turns about; to turn takes its own time [s]."""
    helps: int = 2
    """How often it does so before it gives the goal up."""
    progress: float = 0.3
    """How far the robot must have got to have made progress [m]."""
    back_speed: float = 0.08
    """[m/s]"""
    back_way: float = 0.15
    """How far it backs up, over ground where there is room [m]."""
    look_rate: float = 0.8
    """Yaw rate of a turn about [rad/s]."""

    def __post_init__(self) -> None:
        require_positive(self, "period", "jump", "patience", "progress", "back_speed", "back_way", "look_rate")

    def build(self) -> Navigator:
        """Make one."""
        return Navigator(self)


class Navigator:
    """`see` every frame, then `drive`."""

    def __init__(self, settings: Navigation) -> None:
        self._settings = settings
        self._follower = settings.follower.build()
        self._around = Surroundings(settings.memory)
        self._pose, self._T_map_odom, self._stamp = SE2(), SE2(), 0.0
        self._planned = -math.inf
        self.ways: Ways | None = None
        """From where the robot was at the last plan; None before the first scan."""
        self.goal: Point | None = None
        """[m] in the map."""
        self.progress = Progress.RESTING
        self._heading: float | None = None  # to be faced at the goal [rad]
        self._within = 0.15
        self._anchor, self._since = SE2(), 0.0  # where there was progress last, and when
        self._turned = 0.0  # since then [rad]
        self._helps = 0
        self._help: tuple[float, float] | None = None  # end of backing up, end of the turn [s]
        self._has_way = False

    @property
    def pose(self) -> SE2:
        """`T_map_base` at the last frame."""
        return self._pose

    @property
    def has_way(self) -> bool:
        """Whether the last plan found a way to the goal."""
        return self._has_way

    @property
    def looking(self) -> bool:
        """Whether it turns about, or backs up."""
        return self._help is not None

    @property
    def stamp(self) -> float:
        """Of the last frame [s]."""
        return self._stamp

    def see(self, frame: SensorFrame, estimate: Estimate, snapshot: Snapshot) -> bool:
        """Take in what is known; returns whether there are new ways."""
        self._around.hear(frame, estimate)
        self._turned += abs(wrap_angle(estimate.T_map_base.yaw - self._pose.yaw))
        away, self._pose, self._stamp = frame.stamp - self._stamp, estimate.T_map_base, frame.stamp
        if away > self._settings.period:  # somebody else has had the wheels, while the pose was lost
            self._get_on()
        if not frame.scans or not (self._jumped(estimate) or frame.stamp - self._planned >= self._settings.period):
            return False
        self._T_map_odom, self._planned = estimate.T_map_odom, frame.stamp
        costmap = Costmap.of(snapshot.map, self._settings.inflation, snapshot.trajectory, self._around.hits(), self.goal)
        self.ways = ways_from(costmap, (self._pose.x, self._pose.y))
        self._replan()
        return True

    def go(self, goal: Point, heading: float | None = None, within: float = 0.15) -> None:
        """Drive to a place [m] in the map and face a heading there within an angle [rad]; a new goal on the way is no progress."""
        if self.progress is not Progress.DRIVING:
            self._help = None
            self._get_on()
        if goal != self.goal or self.progress is not Progress.DRIVING:
            self.goal, self._heading, self._within, self.progress = goal, heading, within, Progress.DRIVING
            self._replan()

    def stop(self) -> None:
        """Have no goal any more."""
        self.goal, self.progress, self._help = None, Progress.RESTING, None

    def look_about(self) -> None:
        """Turn once on the spot before anything else."""
        self._help = self._stamp, self._stamp + math.tau / self._settings.look_rate

    def drive(self) -> Twist:
        """The command now."""
        if self._help is not None:
            return self._helped(*self._help)
        if self.progress is not Progress.DRIVING or self.ways is None:
            return self._follower.rest(self._stamp)
        room = float(self.ways.costmap.room_at(self._pose.as_array()[None, :2])[0])
        if not self._has_way:
            self._watch()
            return self._follower.rest(self._stamp)
        twist = self._follower.follow(self._pose, room, self._around.hits(), self._stamp)
        if twist is None:
            return self._arrive()
        self._watch()
        return twist

    def _jumped(self, estimate: Estimate) -> bool:
        """Whether the map was corrected since the last plan: the pose is not where odometry leads from there."""
        T_odom_base = estimate.T_map_odom.inverse() @ estimate.T_map_base
        off = (self._T_map_odom @ T_odom_base).inverse() @ estimate.T_map_base
        return math.hypot(off.x, off.y) > self._settings.jump

    def _replan(self) -> None:
        self._has_way = False
        if self.ways is None or self.goal is None:
            return
        path = self.ways.to(self.ways.costmap.flat_cell(self.goal))
        if path is not None:
            path[-1] = self.goal
            self._follower.take(path)
            self._has_way = True

    def _arrive(self) -> Twist:
        off = 0.0 if self._heading is None else wrap_angle(self._heading - self._pose.yaw)
        if abs(off) > self._within:
            return self._follower.face(off, self._stamp)
        self.progress = Progress.ARRIVED
        return self._follower.rest(self._stamp)

    def _watch(self) -> None:
        """Help, or give up, when there has been no progress for long."""
        if math.hypot(self._pose.x - self._anchor.x, self._pose.y - self._anchor.y) > self._settings.progress:
            self._get_on()
        turning = min(self._turned, math.tau) / self._settings.follower.yaw_rate
        if self._stamp - self._since < self._settings.patience + turning:
            return
        self._since, self._turned = self._stamp, 0.0
        self._helps += 1
        if self._helps > self._settings.helps:
            self.progress = Progress.FAILED
            return
        end = self._stamp + (self._settings.back_way / self._settings.back_speed if self._can_back() else 0.0)
        self._help = end, end + math.tau / self._settings.look_rate

    def _get_on(self) -> None:
        """There is progress."""
        self._anchor, self._since, self._turned, self._helps = self._pose, self._stamp, 0.0, 0

    def _can_back(self) -> bool:
        """Whether there is room behind."""
        if self.ways is None:
            return False
        s = self._settings
        behind = [self._pose @ SE2(-0.05 * k) for k in range(1, math.ceil(s.back_way / 0.05) + 2)]
        places = np.array([[pose.x, pose.y] for pose in behind])
        return bool(np.isfinite(self.ways.costmap.costs_at(places)).all())

    def _helped(self, backed: float, turned: float) -> Twist:
        """Back up, then turn about: what stands in the way is seen from elsewhere, and what is gone is seen to be gone."""
        if self._stamp < backed:
            return self._follower.back(self._settings.back_speed, self._stamp)
        if self._stamp < turned:
            return self._follower.turn(self._settings.look_rate, self._stamp)
        self._help, self._since, self._turned = None, self._stamp, 0.0
        return self._follower.rest(self._stamp)
