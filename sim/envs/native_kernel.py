"""The kinematic twin of an ideal robot, its scan, its map and its views: many robots in one call, to the bit as `sim.kinematic` has them.

A step is 50 physics steps, then the scan that arrives within it is measured on the way driven, and entered in the map.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim import kernels, lidar_kernel, outline_kernel, rolling_kernel
from sim.envs import map_kernel
from sim.motion import STEP
from sim.rolling_kernel import Pose
from slam.kernels.jit import njit

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]

X, YAW, ROOM, RATES, MOTORS, GOALS = 0, 2, 3, 4, 6, 8
"""Columns of a body: x, y [m], yaw [rad]; the way that is certainly free [m]; left and right wheel rate, the motors' and their goals
[rad/s]."""
BODY = 10
KEPT = 128
"""Physics steps that are kept of each robot's way: longer than a step and the scan in it."""
STEPS, FIRST_STEPS = 50, 55
"""Physics steps in a step, and before the first scan has come."""
MARGIN = 1.1
"""By which the longest way of a step is taken longer."""
CONTACT = 0.005
"""Nearer to anything than this the robot touches it [m]."""

Worlds = tuple[Floats, Floats, Ints, Ints, Floats, NDArray[np.int8], Floats, Floats, Ints, Floats]
"""Of N worlds: `outline_kernel.Outlines` with N in front and rows to spare; sides and hulls of what stops the robot (N, W, 4) and
(N, H, 5); how many sides, solids, sides that stop it and hulls there are (N, 4); T_world_map as x, y, yaw (N, 3)."""
Walls = tuple[Floats, Floats, float]
"""Sides (W, 4) and hulls (H, 5) of what stops a robot, and the radius of the circle that holds it [m]."""
Robots = tuple[Floats, Floats, Ints]
"""Bodies (N, BODY); the poses of their last steps as x, y, sine and cosine of half the yaw (N, KEPT, 4), the newest last; how many
steps they have made (N,), the start included."""
Charts = tuple[Bytes, NDArray[np.int16], Bytes, Bytes]
"""`map_kernel.Chart`, with N in front."""
Device = tuple[
    tuple[Floats, Floats, lidar_kernel.Optics, tuple[float, ...], tuple[float, float], Floats],
    tuple[Floats, Floats],
    tuple[Floats, Pose, float, float],
    tuple[float, float, float],
    tuple[float, float, float, float, float],
]
"""The lidar's `constants`; the draws of a device without noise (B,), (B,); its angles (B,) [rad], T_base_laser, time from beam to beam
[s] and reach [m]; radii and track [m]; lag and limit of the motors, limit of the wheels, fastest wheel [rad/s], radius [m]."""
Limits = tuple[float, float, float, float, float, float]
"""Largest speed [m/s], yaw rate and wheel rate [rad/s], track and left and right radius [m]."""
Sights = tuple[Bytes, Bytes, Singles, Floats, Ints, NDArray[np.bool_]]
"""What is written, N in front: `map_kernel.close_up` and `overview`, ranges (B,) [m], T_map_base (3,), new cells that count, contact."""


@njit
def step(
    worlds: Worlds, robots: Robots, charts: Charts, device: Device, times: tuple[Ints, Floats, Floats], out: tuple[Sights, int, int]
) -> None:
    """Let robots drive on and see; their goals are set.

    Args:
        worlds: what is around them.
        robots: changed.
        charts: changed.
        device: what all robots are.
        times: how many steps each robot has made, -1 before its first, changed; by number of a step when the first beam of its scan
            leaves, and when it ends [s].
        out: `Sights`, written; first robot, and the one after the last.
    """
    sights, first, last = out
    for i in range(first, last):
        count = STEPS if times[0][i] >= 0 else FIRST_STEPS
        times[0][i] += 1
        at = int(times[0][i])
        _drive(_walls(worlds, i, device), (robots[0][i], robots[1][i]), device, count)
        robots[2][i] += count
        ranges, begin, end = _sweep(worlds, robots, device, i, float(times[1][at]))
        T_map_world = rolling_kernel.inverse((worlds[9][i, 0], worlds[9][i, 1], worlds[9][i, 2]))
        mount, angles = device[2][1], device[2][0]
        poses = (
            rolling_kernel.compose(rolling_kernel.compose(T_map_world, begin), mount),
            rolling_kernel.compose(rolling_kernel.compose(T_map_world, end), mount),
        )
        chart = charts[0][i], charts[1][i], charts[2][i], charts[3][i]
        sights[4][i] = map_kernel.insert(chart, (ranges, angles), poses, device[0][4])
        pose = rolling_kernel.compose(T_map_world, _pose_at(robots[1][i], robots[2][i], float(times[2][at])))
        look(chart, (ranges, device[0][4]), pose, (sights[0][i], sights[1][i], sights[2][i], sights[3][i]))
        sights[5][i] = touches(_walls(worlds, i, device), robots[0][i, X], robots[0][i, X + 1], robots[0][i, ROOM])


@njit
def command(bodies: Floats, twists: Floats, limits: Limits) -> None:
    """Set the goals of bodies (N, BODY) to twists (N, 2), as `DriveSpec.limit` and `DriveSpec.wheel_rates` have them."""
    speed, yaw_rate, fastest, track, left, right = limits
    for i in range(len(bodies)):
        v, half = 0.0, 0.0
        if np.isfinite(twists[i, 0]) and np.isfinite(twists[i, 1]):
            v, omega = min(max(twists[i, 0], -speed), speed), min(max(twists[i, 1], -yaw_rate), yaw_rate)
            half = 0.5 * track * omega
            wanted = max(abs((v - half) / left), abs((v + half) / right))
            scale = min(1.0, fastest / wanted) if wanted > 0.0 else 1.0
            v, half = v * scale, 0.5 * track * (omega * scale)
        bodies[i, GOALS] = min(max((v - half) / left, -fastest), fastest)
        bodies[i, GOALS + 1] = min(max((v + half) / right, -fastest), fastest)


@njit
def _walls(worlds: Worlds, i: int, device: Device) -> Walls:
    """What stops a robot."""
    return worlds[6][i, : worlds[8][i, 2]], worlds[7][i, : worlds[8][i, 3]], device[4][4]


@njit
def look(
    chart: map_kernel.Chart, scan: tuple[Floats, tuple[float, float]], pose: Pose, sight: tuple[Bytes, Bytes, Singles, Floats]
) -> None:
    """Write what an agent gets: both views, ranges (as many as there is room for) where nothing is the reach, and the pose."""
    map_kernel.close_up(chart[0], pose, sight[0])
    map_kernel.overview(chart[2], pose, sight[1])
    (ranges, limits), count = scan, len(sight[2])
    for k in range(count):
        r = ranges[k if len(ranges) == count else (k * (len(ranges) - 1)) // (count - 1)]
        sight[2][k] = min(r, limits[1]) if r >= limits[0] else 0.0
    sight[3][0], sight[3][1], sight[3][2] = pose


@njit
def touches(walls: Walls, x: float, y: float, room: float) -> bool:
    """Whether a robot at a place touches something; `room` is the way that is certainly free [m]."""
    return room < CONTACT and rolling_kernel.clearance(walls, x, y) < walls[2] + CONTACT


@njit
def _drive(walls: Walls, robot: tuple[Floats, Floats], device: Device, steps: int) -> None:
    """Make physics steps and keep their poses."""
    body, rows = robot
    lag, fastest_change, brake, fastest = device[4][:4]
    for k in range(KEPT - steps):
        rows[k] = rows[k + steps]
    added = rows[KEPT - steps :]
    longest = MARGIN * steps * STEP * fastest * max(device[3][0], device[3][1])
    if body[ROOM] < longest:
        walls = rolling_kernel.nearby(walls, body[X], body[X + 1], longest)
    wheels, motors = (body[RATES], body[RATES + 1]), (body[MOTORS], body[MOTORS + 1])
    goals = body[GOALS], body[GOALS + 1]
    pose, room = (body[X], body[X + 1], body[YAW]), body[ROOM]
    for k in range(steps):
        if motors != goals:
            motors = rolling_kernel.approached(motors, goals, lag, fastest_change)
        wheels = rolling_kernel.braked(wheels, motors, (brake, brake))
        pose, room = rolling_kernel.roll(pose, room, (wheels[0] * STEP, wheels[1] * STEP), device[3], walls)
        half = 0.5 * pose[2]
        added[k, 0], added[k, 1], added[k, 2], added[k, 3] = pose[0], pose[1], math.sin(half), math.cos(half)
    body[X], body[X + 1], body[YAW], body[ROOM] = pose[0], pose[1], pose[2], room
    body[RATES], body[RATES + 1], body[MOTORS], body[MOTORS + 1] = wheels[0], wheels[1], motors[0], motors[1]


@njit
def _sweep(worlds: Worlds, robots: Robots, device: Device, i: int, stamp: float) -> tuple[Floats, Pose, Pose]:
    """The scan (B,) [m] whose first beam leaves at `stamp` [s], and T_world_base at its first and last beam."""
    (directions, mount, optics, model, limits, biases), (draws, normals), (_, _, increment, reach) = device[0], device[1], device[2]
    steps, rows = robots[2][i], robots[1][i]
    end = stamp + (len(directions) - 1) * increment
    first = int(stamp / STEP)
    last = max(min(int(np.ceil(end / STEP)), steps - 1), first + 1)
    window = rows[KEPT - steps + first : KEPT - steps + last + 1]
    places = (stamp - first * STEP) / STEP, increment / STEP
    origins, turned = kernels.beams(_frames_of(window), places, directions, mount)
    sides, solids = worlds[8][i, 0], worlds[8][i, 1]
    outlines = (
        worlds[0][i, :sides],
        worlds[1][i, :sides],
        worlds[2][i, :sides],
        worlds[3][i, :solids],
        worlds[4][i, :solids],
        worlds[5][i, :solids],
    )
    met = outline_kernel.meet(outlines, origins, turned, reach)
    ranges = lidar_kernel.report(met, (draws, normals), optics, model, biases, limits)
    return ranges, _pose_at(rows, steps, stamp), _pose_at(rows, steps, end)


@njit
def _pose_at(rows: Floats, steps: int, t: float) -> Pose:
    """As `sim.motion.Motion.pose_at`."""
    place = min(t / STEP, steps - 1.0)
    k = min(int(place), max(steps - 2, 0))
    f = place - k
    a, b = rows[KEPT - steps + k], rows[KEPT - steps + min(k + 1, steps - 1)]
    before, after = _yaw(a), _yaw(b)
    yaw = rolling_kernel.wrapped(before + f * rolling_kernel.wrapped(after - before))
    return a[0] + f * (b[0] - a[0]), a[1] + f * (b[1] - a[1]), yaw


@njit
def _yaw(row: Floats) -> float:
    """Of a pose that is kept [rad], as `kernels.to_base` has it."""
    return np.arctan2(2.0 * (row[2] * row[3]), 1.0 - 2.0 * (row[2] * row[2]))


@njit
def _frames_of(rows: Floats) -> Floats:
    """As `kernels.frames_of`, of poses that are kept."""
    frames = np.zeros((len(rows), 12))
    for k in range(len(rows)):
        x, y, z, w = rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3]
        frames[k, 0] = frames[k, 4] = 1.0 - 2.0 * (z * z)
        frames[k, 1], frames[k, 3] = -2.0 * (z * w), 2.0 * (z * w)
        frames[k, 8], frames[k, 9], frames[k, 10] = 1.0, x, y
    return frames
