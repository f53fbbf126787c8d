import numpy as np
import pytest

from slam.localization.seen_directions import SeenDirections
from slam.se2 import SE2

P_ODO = SE2(1.0, 2.0, 0.3)
ALL, ALONG_30_DEG = np.diag([200.0, 200.0, 200.0]), np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)])


def corridor(axis, beams=600.0):
    """D of so many beams of 1 / m^2 that meet the walls of a corridor along an axis, with levers of 2 m."""
    normal = np.array([-axis[1], axis[0]])
    levers = np.linspace(-2.0, 2.0, 60)
    g = np.column_stack([np.broadcast_to(normal, (60, 2)), levers])
    return g.T @ g * beams / 60.0


def test_where_everything_is_seen_the_scan_has_the_word():
    seen = SeenDirections.of(ALL, 1e-4 * np.eye(3), 1.0)
    fused = seen.fuse(P_ODO, SE2(1.1, 1.9, 0.35), 1e-4 * np.eye(3))
    assert (fused.x, fused.y, fused.yaw) == pytest.approx((1.1, 1.9, 0.35), abs=5e-4)


def test_along_a_corridor_the_scan_neither_judges_nor_moves():
    C = np.diag([0.01, 0.01, 0.01])
    seen = SeenDirections.of(corridor(ALONG_30_DEG), C, 1.0)
    along = np.array([[1.0, 2.0, 0.3]]) + np.array([[*(0.2 * ALONG_30_DEG), 0.0]])
    assert seen.level(along, P_ODO)[0] == pytest.approx(P_ODO.as_array())
    fused = seen.fuse(P_ODO, SE2(1.2, 2.3, 0.4), C)
    assert np.array([fused.x - 1.0, fused.y - 2.0]) @ ALONG_30_DEG == pytest.approx(0.0, abs=1e-9)
    assert fused.yaw == 0.4


def test_across_a_corridor_the_scan_has_the_word():
    C = np.diag([0.01, 0.01, 0.01])
    seen = SeenDirections.of(corridor(np.array([1.0, 0.0])), C, 1.0)
    assert seen.fuse(P_ODO, SE2(1.2, 2.1, 0.3), C).y == pytest.approx(2.1, abs=1e-3)
    assert seen.level(np.array([[1.2, 2.1, 0.3]]), P_ODO)[0] == pytest.approx([1.0, 2.1, 0.3], abs=1e-3)


def test_what_is_seen_says_what_goes_with_it_along_the_corridor():
    C = np.array([[0.01, 0.005, 0.0], [0.005, 0.01, 0.0], [0.0, 0.0, 0.01]])
    seen = SeenDirections.of(corridor(np.array([1.0, 0.0])), C, 1.0)
    assert seen.fuse(P_ODO, SE2(1.0, 2.1, 0.3), C).x == pytest.approx(1.05, abs=1e-3)


def test_ten_beams_on_somebody_move_a_set_half_way():
    C = np.diag([0.01, 0.01, 0.01])
    D = corridor(np.array([1.0, 0.0])) + np.diag([10.0, 0.0, 0.0])
    assert SeenDirections.of(D, C, 1.0).fuse(P_ODO, SE2(1.1, 2.0, 0.3), C).x == pytest.approx(1.05)


def test_a_set_that_is_spread_wide_is_judged_as_it_lies():
    C = np.diag([1.0, 1.0, 0.01])
    poses = np.array([[3.0, 4.0, 0.2], [0.0, 1.0, 0.5]])
    seen = SeenDirections.of(np.zeros((3, 3)), C, 1.0)
    assert seen.level(poses, P_ODO) == pytest.approx(poses)
    assert seen.fuse(P_ODO, SE2(1.2, 2.1, 0.4), C).as_array() == pytest.approx([1.2, 2.1, 0.4])


def test_without_spread_and_without_sight_nothing_moves():
    fused = SeenDirections.of(np.zeros((3, 3)), np.zeros((3, 3)), 1.0).fuse(P_ODO, P_ODO, np.zeros((3, 3)))
    assert fused.as_array() == pytest.approx(P_ODO.as_array())
