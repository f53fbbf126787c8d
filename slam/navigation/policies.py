"""Policies by name: what drives the robot, from the estimate alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from slam.errors import SlamError, UnknownNameError
from slam.messages import Estimate, SensorFrame, Twist
from slam.navigation.explore import Explore
from slam.navigation.goal import GoTo
from slam.navigation.perimeter import Perimeter
from slam.navigation.spin import Spin
from slam.navigation.tour import Tour
from slam.navigation.wander import Wander
from slam.se2 import FloatArray
from slam.snapshot import Snapshot


class Policy(Protocol):
    """Decides the next command."""

    def __call__(self, frame: SensorFrame, estimate: Estimate, snapshot: Snapshot) -> Twist | None:
        """The twist of `base` to command now; None leaves the robot alone."""
        ...


class PolicySettings(Protocol):
    """A frozen dataclass of parameters that builds a policy."""

    def build(self, route: FloatArray) -> Policy:
        """Make the policy; `route` (N, 2) [m] are the world's waypoints in the map."""
        ...


@dataclass(frozen=True, slots=True)
class Idle:
    """Never drive: for recordings, and for a robot that is driven by somebody else."""

    def build(self, route: FloatArray) -> Policy:
        """Make the policy."""
        return _idle


def _idle(frame: SensorFrame, estimate: Estimate, snapshot: Snapshot) -> Twist | None:
    return None


POLICIES: dict[str, type[PolicySettings]] = {
    "tour": Tour,
    "goal": GoTo,
    "explore": Explore,
    "wander": Wander,
    "spin": Spin,
    "perimeter": Perimeter,
    "none": Idle,
}
"""name -> frozen dataclass of parameters."""


def make_policy(name: str, route: FloatArray, settings: PolicySettings | None = None) -> Policy:
    """The policy of that name on a route (N, 2) [m] in the map; with its parameters where they are not the defaults.

    Raises:
        UnknownNameError: no such policy; the message lists those there are.
        SlamError: it needs a route and there is none.
    """
    if name not in POLICIES:
        raise UnknownNameError("policy", name, sorted(POLICIES))
    if name == "tour" and len(route) < 2:
        raise SlamError("the policy 'tour' needs a world with a tour of two waypoints or more; use --policy none")
    return (settings or POLICIES[name]()).build(route)
