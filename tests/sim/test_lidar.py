import math

import numpy as np
import pytest

from hardware.spec import LidarSpec
from sim.lidar import ARRIVAL, Lidar
from sim.lidar_errors import LidarErrors
from sim.motion import STEP, Motion
from sim.moving import moving_bodies
from sim.rays import EmbreeRays
from sim.realism import REALISMS, Realism
from sim.scene import static_triangles
from slam.se3 import SE3
from worlds.parts import Box

SPEC = LidarSpec()


def motion_of(pose, bodies=0, body=None, duration=0.2):
    """Rows of a base that moves as `pose(t) -> x, y, yaw` and a body as `body(t) -> x, y`."""
    motion = Motion(bodies, SE3())
    rows = []
    for k in range(round(duration / STEP) + 1):
        x, y, yaw = pose(k * STEP)
        row = (x, y, 0.0, 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2), 0.0, 0.0)
        rows.append(row if body is None else (*row, *body(k * STEP), 0.15, 0.0, 0.0, 0.0, 1.0))
    motion.append(rows)
    return motion


def lidar_in(world, realism=REALISMS["ideal"], spec=SPEC, seed=0):
    return Lidar(spec, realism, EmbreeRays(static_triangles(world)), moving_bodies(world), np.random.default_rng(seed))


def room_range(x, y, heading):
    """Distance to the walls of the 4 x 3 m room."""
    c, s = np.cos(heading), np.sin(heading)
    with np.errstate(divide="ignore"):
        along_x = np.where(c == 0.0, np.inf, (np.where(c > 0.0, 2.0, -2.0) - x) / c)
        along_y = np.where(s == 0.0, np.inf, (np.where(s > 0.0, 1.5, -1.5) - y) / s)
    return np.minimum(along_x, along_y)


def expected(pose, stamp):
    """What each beam should read from the pose at its own time."""
    times = stamp + SPEC.time_increment * np.arange(SPEC.beams)
    ranges = []
    for t, angle in zip(times, SPEC.angles, strict=True):
        x, y, yaw = pose(t)
        mx, my, _ = SPEC.T_base_laser.t
        lx, ly = x + math.cos(yaw) * mx - math.sin(yaw) * my, y + math.sin(yaw) * mx + math.cos(yaw) * my
        ranges.append(room_range(lx, ly, yaw + angle))
    return np.array(ranges)


@pytest.mark.parametrize(
    "pose",
    [
        pytest.param(lambda t: (0.3, -0.2, 0.7), id="standing"),
        pytest.param(lambda t: (0.5 * t, 0.1, 0.0), id="driving"),
        pytest.param(lambda t: (0.0, 0.0, 3.0 * t), id="turning"),
        pytest.param(
            lambda t: (0.3 * math.sin(t), 0.3 - 0.3 * math.cos(t), math.pi - 0.1 + 2.0 * t), id="driving a curve across the heading of pi"
        ),
    ],
)
def test_every_beam_is_cast_from_the_pose_at_its_own_time(room, pose):
    scan = lidar_in(room()).scan(motion_of(pose), stamp=0.0043)
    assert scan.ranges == pytest.approx(expected(pose, 0.0043), abs=0.6e-3)


def test_without_its_own_time_a_turn_would_smear_the_scan(room):
    def turning(t):
        return 0.0, 0.0, 3.0 * t

    frozen = room_range(0.03, 0.0, SPEC.angles)
    scan = lidar_in(room()).scan(motion_of(turning), stamp=0.0)
    assert np.abs(scan.ranges - frozen).max() > 0.1


def test_an_upside_down_lidar_sees_the_room_mirrored(room):
    spec = LidarSpec(T_base_laser=SE3.from_xyz_rpy((0.0, 0.0, 0.18), (math.pi, 0.0, 0.0)))
    scan = lidar_in(room(), spec=spec).scan(motion_of(lambda t: (0.3, -0.2, 0.4)), 0.0)
    assert scan.ranges == pytest.approx(room_range(0.3, -0.2, 0.4 - SPEC.angles), abs=0.6e-3)


def test_a_moving_body_is_seen_where_it_is_at_each_beams_time(room):
    world = room(boxes=(Box((1.0, 0.0), (0.2, 0.4, 0.3), mass=1.0),))
    motion = motion_of(lambda t: (0.0, 0.0, 0.0), 1, lambda t: (1.0 + t, 0.0))
    scan = lidar_in(world).scan(motion, stamp=0.0)
    front = 340
    t = front * SPEC.time_increment
    assert scan.angles[front] == 0.0
    assert scan.ranges[front] == pytest.approx(1.0 + t - 0.1 - 0.03, abs=0.6e-3)


def test_ranges_are_whole_millimetres(room):
    scan = lidar_in(room(), REALISMS["datasheet"]).scan(motion_of(lambda t: (0.0, 0.0, 0.0)), 0.0)
    millimetres = scan.ranges[np.isfinite(scan.ranges)] * 1000.0
    assert millimetres == pytest.approx(np.round(millimetres), abs=1e-9)


def test_noise_has_the_data_sheets_size(room):
    lidar, motion = lidar_in(room(), REALISMS["datasheet"]), motion_of(lambda t: (0.0, 0.0, 0.0))
    true = expected(lambda t: (0.0, 0.0, 0.0), 0.0)
    errors = np.array([lidar.scan(motion, 0.0).ranges - true for _ in range(200)])
    sigmas = np.maximum(0.010, 0.01 * true)
    assert np.abs(np.nanmean(errors, axis=0)).max() < 0.03
    assert np.nanmedian(np.nanstd(errors, axis=0) / sigmas) == pytest.approx(1.0, abs=0.05)


def test_what_is_too_far_or_too_near_is_infinite(room):
    spec = LidarSpec(range_min=1.55, range_max=1.9)
    ranges = lidar_in(room(), spec=spec).scan(motion_of(lambda t: (0.0, 0.0, 0.0)), 0.0).ranges
    true = expected(lambda t: (0.0, 0.0, 0.0), 0.0)
    assert np.all(ranges[true < 1.549] == -np.inf)
    assert np.all(ranges[true > 1.901] == np.inf)


def test_noise_may_bring_a_wall_beyond_the_range_into_it(room):
    spec = LidarSpec(range_max=1.96)
    scan = lidar_in(room(), Realism(LidarErrors(range_sigma=0.02)), spec).scan(motion_of(lambda t: (0.0, 0.0, 0.0)), 0.0)
    assert np.any(np.isfinite(scan.ranges[330:350]))


def test_a_scan_is_stamped_with_its_first_beam_and_arrives_later(room):
    lidar, motion = lidar_in(room()), motion_of(lambda t: (0.0, 0.0, 0.0))
    assert lidar.due == pytest.approx(725 * 0.1 / 1024)
    lidar.sweep(motion)
    assert lidar.arrived(ARRIVAL - 1e-6) == []
    ((arrival, scan),) = lidar.arrived(ARRIVAL)
    assert arrival == ARRIVAL
    assert scan.stamp == pytest.approx(44 * 0.1 / 1024)
    assert lidar.due == pytest.approx(0.1 + 725 * 0.1 / 1024)
