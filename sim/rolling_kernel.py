"""Wheels that roll on a plane without slipping under a circle that walls stop; and the perfect motors that turn them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim import outline_kernel
from slam.kernels.jit import inlined, njit

Floats = NDArray[np.float64]
Pose = tuple[float, float, float]
"""x, y [m], yaw [rad] in (-pi, pi]."""


@inlined
def roll(
    pose: Pose, room: float, turned: tuple[float, float], drive: tuple[float, float, float], walls: tuple[Floats, Floats, float]
) -> tuple[Pose, float]:
    """Where the body is when its wheels have turned, and the way that is certainly free then [m].

    Where the circle would come nearer to an outline, the body turns with its wheels but stays in its place.

    Args:
        pose: of the body before.
        room: the way that is certainly free before [m].
        turned: of the wheels, left and right [rad].
        drive: radii of the wheels, left and right, and track [m].
        walls: sides and hulls of `outline_kernel.clearance_of`, and the circle's radius [m].
    """
    moved = compose(pose, arc(turned, drive))
    way = math.sqrt((moved[0] - pose[0]) ** 2 + (moved[1] - pose[1]) ** 2)
    if way > room:
        now, then = clearance(walls, pose[0], pose[1]), clearance(walls, moved[0], moved[1])
        room = max(now - walls[2], 0.0)
        if then < min(walls[2], now):  # on its way out it may go
            moved, way = (pose[0], pose[1], moved[2]), 0.0
    return moved, room - way


@njit
def clearance(walls: tuple[Floats, Floats, float], x: float, y: float) -> float:
    """How far a place is from the nearest wall [m]."""
    return outline_kernel.clearance_of(walls[0], walls[1], x, y)


@njit
def nearby(walls: tuple[Floats, Floats, float], x: float, y: float, way: float) -> tuple[Floats, Floats, float]:
    """The walls that may be the nearest to some place on a way of so many metres from here: all that `clearance` needs there."""
    sides, hulls, radius = walls
    reach, count = clearance(walls, x, y) + 2.0 * way, 0
    kept = np.empty_like(hulls)
    for k in range(len(hulls)):
        if math.sqrt((hulls[k, 0] - x) ** 2 + (hulls[k, 1] - y) ** 2) - hulls[k, 2] <= reach:
            kept[count] = hulls[k]
            count += 1
    return sides, kept[:count], radius


@inlined
def arc(turned: tuple[float, float], drive: tuple[float, float, float]) -> Pose:
    """The body's motion while its wheels turn: exact. See `slam.se2.SE2.exp`."""
    left, right = turned[0] * drive[0], turned[1] * drive[1]
    v, omega = 0.5 * (left + right), (right - left) / drive[2]
    if abs(omega) < 1e-6:
        a, b = 1.0 - omega * omega / 6.0, omega / 2.0 - omega * omega * omega / 24.0
    else:
        a, b = math.sin(omega) / omega, 2.0 * math.sin(omega / 2.0) ** 2 / omega
    return a * v, b * v, omega


@inlined
def compose(a: Pose, b: Pose) -> Pose:
    """`T_0_2 = T_0_1 @ T_1_2`, as `slam.se2.SE2` does."""
    c, s = math.cos(a[2]), math.sin(a[2])
    return a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], wrapped(a[2] + b[2])


@njit
def inverse(a: Pose) -> Pose:
    """`T_1_0` of `T_0_1`."""
    c, s = math.cos(a[2]), math.sin(a[2])
    return -c * a[0] - s * a[1], s * a[0] - c * a[1], wrapped(-a[2])


@inlined
def wrapped(angle: float) -> float:
    """An angle of less than three half turns in (-pi, pi] [rad]."""
    if angle > math.pi:
        return angle - math.tau
    return angle + math.tau if angle <= -math.pi else angle


@inlined
def approached(rates: tuple[float, float], goals: tuple[float, float], gain: float, limit: float) -> tuple[float, float]:
    """Wheel rates one step nearer to their goals [rad/s]: by a share of what is missing, `limit` at most."""
    return _approached(rates[0], goals[0], gain, limit), _approached(rates[1], goals[1], gain, limit)


@inlined
def _approached(rate: float, goal: float, gain: float, limit: float) -> float:
    if abs(goal - rate) < 1e-6:
        return goal
    return rate + min(max((goal - rate) * gain, -limit), limit)


@inlined
def braked(rates: tuple[float, float], wanted: tuple[float, float], limits: tuple[float, float]) -> tuple[float, float]:
    """Wheel rates that torques bring towards those wanted, by `limits` at most [rad/s]."""
    left = rates[0] + min(max(wanted[0] - rates[0], -limits[0]), limits[0])
    return left, rates[1] + min(max(wanted[1] - rates[1], -limits[1]), limits[1])
