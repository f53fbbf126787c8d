"""What a robot does that does not know where it is."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, field

from slam.messages import Estimate, SensorFrame, Status, Twist
from slam.navigation.safe_course import SafeCourse
from slam.se2 import wrap_angle

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Astray:
    """Stop, look around, then look for other places: one that looks like another must be left."""

    stop: float = 0.5
    """Time to stand still first: what is misread in a turn is read well at rest [s]."""
    look_around: float = 0.5
    """Yaw rate at which the robot turns once on the spot [rad/s]."""
    course: SafeCourse = field(default_factory=SafeCourse)
    """How it drives on if that has not told it."""

    def build(self) -> Searcher:
        """Make what keeps to it."""
        return Searcher(self)


class Searcher:
    """Takes the wheels while the pose is lost or one of several."""

    def __init__(self, settings: Astray) -> None:
        self._settings = settings
        self._course = settings.course.build()
        self._since: float | None = None
        self._turned, self._heading = 0.0, 0.0  # while astray [rad], and odometry's heading then

    def __call__(self, frame: SensorFrame, estimate: Estimate) -> Twist | None:
        """The next command; None where the pose is known."""
        heading = estimate.T_map_odom.inverse().yaw + estimate.T_map_base.yaw
        turn, self._heading = abs(wrap_angle(heading - self._heading)), heading
        if estimate.status not in (Status.LOST, Status.AMBIGUOUS):
            if self._since is not None:
                _log.warning("the robot knows again where it is, after %.1f s", frame.stamp - self._since)
            self._since, self._turned = None, 0.0
            return None
        if self._since is None:
            _log.warning("the robot does not know where it is (%s); it stops and looks around", estimate.reason or estimate.status)
            self._since = frame.stamp
        if frame.stamp - self._since < self._settings.stop:
            return Twist()
        self._turned += turn
        return Twist(0.0, self._settings.look_around) if self._turned < math.tau else self._course(frame)
