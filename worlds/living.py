"""What changes in a world by the clock: doors, people, light. Frozen descriptions; a door and the light are functions of time."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta

from worlds.parts import Angle, FloatArray, Length, Material, Point, rectangle

Duration = Annotated[float, Meta(ge=0.0, le=86400.0)]
Level = Annotated[float, Meta(ge=0.0, le=4.0)]
Seed = Annotated[int, Meta(ge=0)]
DoorState = Literal["closed", "open", "ajar", "swinging"]

AJAR = 0.3
"""How far a door that is ajar is open, as a share of its way."""
SWING_TIME = 2.0
"""From open to closed and back [s]."""
PERSON_RADIUS = 0.2
"""What a person's way keeps free of walls and furniture [m]."""


class Door(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A leaf that turns about an upright hinge."""

    hinge: Point
    """Axis of the hinge, on the centre line of the leaf (x, y) [m]."""
    yaw: Angle
    """Direction from the hinge to the other edge where the door is closed [rad]."""
    width: Length = 0.8
    thickness: Length = 0.04
    height: Length = 2.0
    opening: Angle = 1.5708
    """Turn from closed to wide open; above 0: counter-clockwise [rad]."""
    state: DoorState = "closed"
    """`swinging` doors are open at first, then close and open for ever."""
    delay: Duration = 4.0
    """When a swinging door first begins to close [s]."""
    period: Annotated[float, Meta(ge=3.0 * SWING_TIME, le=86400.0)] = 16.0
    """Of a swinging door, from one closing to the next [s]; it opens half a period after it began to close."""
    material: Material = "matte"

    @property
    def z_span(self) -> tuple[float, float]:
        """Lowest and highest z [m]."""
        return 0.0, self.height

    @property
    def mass(self) -> float:
        """A door is moved by the clock, never by what bumps into it."""
        return 0.0

    def angle_at(self, t: float) -> float:
        """Turn of the leaf away from closed at time `t` [s], towards `opening` [rad]."""
        if self.state == "swinging":
            return self.opening * self._share_open(t)
        return self.opening * {"closed": 0.0, "ajar": AJAR, "open": 1.0}[self.state]

    def pose_at(self, t: float) -> tuple[float, float, float]:
        """Middle of the leaf (x, y) [m] and its direction away from the hinge [rad] at time `t` [s]."""
        yaw = self.yaw + self.angle_at(t)
        return self.hinge[0] + self.width / 2 * math.cos(yaw), self.hinge[1] + self.width / 2 * math.sin(yaw), yaw

    def footprint(self, t: float = 0.0) -> FloatArray:
        """Corners (4, 2) [m] of the leaf at time `t` [s], counter-clockwise."""
        x, y, yaw = self.pose_at(t)
        return rectangle((x, y), (self.width, self.thickness), yaw)

    def _share_open(self, t: float) -> float:
        since = (t - self.delay) % self.period if t > self.delay else 0.0
        closing, opening = since / SWING_TIME, (since - self.period / 2) / SWING_TIME
        return 1.0 - _smooth(closing) + _smooth(opening)


class Person(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Somebody who walks from waypoint to waypoint, stops there for a while, and begins anew."""

    path: Annotated[tuple[Point, ...], Meta(min_length=1)]
    """Waypoints (x, y) [m]; after the last one comes the first again. Who has one stands there."""
    speed: Annotated[float, Meta(ge=0.1, le=3.0)] = 0.8
    """On the way [m/s]."""
    pauses: tuple[Duration, ...] = ()
    """Time spent at each waypoint, in order, from the first on, where the walk begins [s]; 0 where the list has ended."""
    height: Annotated[float, Meta(ge=0.8, le=2.3)] = 1.75
    """[m]"""
    seed: Seed = 0
    """Of clothes and gait."""

    def legs(self) -> list[tuple[Point, Point]]:
        """The straight legs of a round, the one back to the first waypoint last."""
        return list(zip(self.path, (*self.path[1:], *self.path[:1]), strict=True)) if len(self.path) > 1 else []


class Light(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How bright it is: `ambient` everywhere, `diffuse` on what faces the light, both times a level that changes with time."""

    ambient: Level = 0.5
    diffuse: Level = 0.5
    yaw: Angle = 0.8
    """Direction from which the light comes [rad]."""
    elevation: Annotated[float, Meta(ge=0.0, le=1.5708)] = 0.9
    """Height of that direction above the floor [rad]."""
    levels: tuple[tuple[Duration, Level], ...] = ()
    """Times [s] and factors on both from then on, blended from one to the next; 1 where there are none."""

    def level_at(self, t: float) -> float:
        """Factor on `ambient` and `diffuse` at time `t` [s]."""
        if not self.levels:
            return 1.0
        times, factors = zip(*self.levels, strict=True)
        return float(np.interp(t, times, factors))


def _smooth(share: float) -> float:
    """From 0 to 1 with no jump in speed."""
    x = min(max(share, 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)
