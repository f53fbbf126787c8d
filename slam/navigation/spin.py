"""The `spin` policy: to the middle of the route, and once round on the spot, in steps."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from slam.errors import ParameterError, require_not_negative, require_positive
from slam.messages import Estimate, SensorFrame, Twist
from slam.navigation.tour import Tour, TourPolicy
from slam.se2 import FloatArray, wrap_angle
from slam.snapshot import Snapshot

THERE = 0.1
"""Distance to the middle at which the robot is there [m]."""
SETTLED = 0.02
"""Of a step, what may be left of it [rad]."""


@dataclass(frozen=True, slots=True)
class Spin:
    """Look all round: turn, stand still until the camera has seen a sharp picture, turn on; then stand.

    The source report made its marker map by such a turn in the middle of the room.
    """

    step: float = math.radians(10.0)
    """From one standstill to the next [rad]."""
    dwell: float = 0.6
    """How long each of them lasts [s]."""
    yaw_rate: float = 0.6
    """While it turns [rad/s]."""
    turns: float = 1.0
    """How often it turns round."""
    middle: bool = True
    """Follow the route first, to its point that is nearest to its middle; without a route, or when false, it turns where it is."""
    way: Tour = field(default_factory=Tour)
    """How it drives there."""

    def __post_init__(self) -> None:
        require_positive(self, "step", "yaw_rate", "turns")
        require_not_negative(self, "dwell")
        if self.step > math.pi:
            raise ParameterError(self, "step", "at most half a turn")

    def build(self, route: FloatArray) -> SpinPolicy:
        """Make the policy; `route` (N, 2) [m] are the world's waypoints in the map."""
        return SpinPolicy(self, route)


class SpinPolicy:
    """Counts what it has turned by the estimate."""

    def __init__(self, settings: Spin, route: FloatArray) -> None:
        self._settings = settings
        self._middle = nearest_to_the_middle(route) if settings.middle and len(route) > 1 else None
        self._tour = TourPolicy(settings.way, route)
        self._heading = math.nan
        self._turned, self._steps = 0.0, 0
        self._still_since = -math.inf

    @property
    def done(self) -> bool:
        """Whether it has turned as often as it should."""
        return self._turned > math.tau * self._settings.turns - SETTLED

    def __call__(self, frame: SensorFrame, estimate: Estimate, snapshot: Snapshot) -> Twist:
        """The next command."""
        pose = estimate.T_map_base
        if self._middle is not None:
            if math.hypot(pose.x - self._middle[0], pose.y - self._middle[1]) > THERE:
                return self._tour(frame, estimate, snapshot)
            self._middle = None
        self._turned += 0.0 if math.isnan(self._heading) else wrap_angle(pose.yaw - self._heading)
        self._heading = pose.yaw
        left = self._steps * self._settings.step - self._turned
        if left > SETTLED:
            self._still_since = frame.stamp
            return Twist(0.0, min(self._settings.yaw_rate, max(4.0 * left, 0.1)))
        if not self.done and frame.stamp - self._still_since >= self._settings.dwell:
            self._steps += 1
        return Twist()


def nearest_to_the_middle(route: FloatArray) -> tuple[float, float]:
    """The point (x, y) [m] of a closed route (N, 2) that is nearest to the mean of its waypoints."""
    ends, middle = np.roll(route, -1, axis=0), route.mean(axis=0)
    legs = ends - route
    shares = np.clip(np.sum((middle - route) * legs, axis=1) / np.maximum(np.sum(legs * legs, axis=1), 1e-9), 0.0, 1.0)
    points = route + shares[:, None] * legs
    x, y = points[int(np.argmin(np.hypot(*(points - middle).T)))].tolist()
    return x, y
