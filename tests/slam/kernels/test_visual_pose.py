"""The pose from points with depth."""

from __future__ import annotations

import numpy as np
import pytest

from hardware.camera_spec import camera_mount
from slam.kernels.visual_pose import depths_at, pixels_of, placed, rays_of, refine
from slam.se2 import SE2
from slam.se3 import SE3

LENS = (612.0, 610.0, 423.5, 239.5, np.array([0.05, -0.02, 0.001, -0.001, 0.0]))
MOUNT = camera_mount((0.08, 0.0, 0.2), 0.1)
AT = np.array(MOUNT.R), np.array(MOUNT.t)
STILL = np.zeros(3)
MOTION = SE3.from_se2(SE2(0.12, 0.01, 0.08))
FREE = (np.eye(3), np.zeros(3)), np.eye(6) * 1e-6


def points(rng: np.random.Generator, count: int = 150) -> np.ndarray:
    return np.column_stack([rng.uniform(1.5, 4.0, count), rng.uniform(-1.0, 1.0, count), rng.uniform(0.0, 1.0, count)])


def arrays(T: SE3) -> tuple[np.ndarray, np.ndarray]:
    return np.array(T.R), np.array(T.t)


def seen(P: np.ndarray, T: SE3, twist: np.ndarray = STILL, row_time: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Rays and delays of points of the keyframe's base from a moving robot, row by row."""
    pixels, delays = pixels_of(P, arrays(T), AT, LENS), np.zeros(len(P))
    for _ in range(8 if row_time else 0):
        delays = (pixels[:, 1] - 239.5) * row_time
        now = [T @ SE3.from_se2(SE2.exp(twist * d)) for d in delays]
        pixels = np.concatenate([pixels_of(P[k : k + 1], arrays(n), AT, LENS) for k, n in enumerate(now)])
    return rays_of(pixels, LENS), delays


def solve(P: np.ndarray, rays: np.ndarray, delays: np.ndarray, twist: np.ndarray = STILL, errors: np.ndarray | None = None) -> tuple:
    errors = np.zeros_like(P) if errors is None else errors
    R, t, H, chi = refine(arrays(SE3()), (P, errors, rays, delays), (*AT, twist), FREE, (0.2 / 611.0, 6.0))
    return SE3(R, t), H, chi


def test_the_pose_of_exact_points_is_exact() -> None:
    P = points(np.random.default_rng(1))
    T, _, chi = solve(P, *seen(P, MOTION))
    np.testing.assert_allclose((MOTION.inverse() @ T).log(), 0.0, atol=1e-6)
    assert chi.max() < 1e-4


def test_points_that_moved_do_not_pull() -> None:
    rng = np.random.default_rng(2)
    P = points(rng)
    rays, delays = seen(P, MOTION)
    rays[:45] += rng.uniform(0.05, 0.3, (45, 2))
    T, _, chi = solve(P, rays, delays)
    np.testing.assert_allclose((MOTION.inverse() @ T).log(), 0.0, atol=2e-3)
    assert (chi[45:] < 12.0).all()


def test_rows_that_are_read_later_are_seen_from_later() -> None:
    P, twist = points(np.random.default_rng(3)), np.array([0.3, 0.0, 1.0])
    T, _, _ = solve(P, *seen(P, MOTION, twist, 3.5e-5), twist)
    np.testing.assert_allclose((MOTION.inverse() @ T).log(), 0.0, atol=1e-4)


def test_the_covariance_is_that_of_many_samples() -> None:
    rng, errors = np.random.default_rng(4), []
    P = points(rng)
    rays, delays = seen(P, MOTION)
    for _ in range(80):
        T, H, _ = solve(P, rays + rng.normal(0.0, 0.2 / 611.0, rays.shape), delays)
        errors.append((MOTION.inverse() @ T).log())
    sample, told = np.std(errors, axis=0), np.sqrt(np.diag(np.linalg.inv(H)))
    assert (sample < 1.6 * told).all()
    assert (sample > 0.5 * told).all()


def test_depth_is_read_between_two_cameras_and_not_at_edges() -> None:
    lens, T = (424.0, 424.0, 423.5, 239.5, np.zeros(5)), (np.eye(3), np.array([-0.015, 0.0, 0.0]))
    depth = np.full((480, 848), 2.0, np.float32)
    depth[:, 500:] = 3.0
    depth[200:240, 100:140] = np.nan
    rays = np.array([[-0.2, 0.1], [0.4, 0.1], [0.1815 + 0.015 / 2.0, 0.0], [-0.7, -0.05], [3.0, 0.0]])
    found = depths_at(rays, depth, lens, T)
    np.testing.assert_allclose(found[:2], [2.0, 3.0], atol=1e-5)
    assert np.isnan(found[2:]).all()


@pytest.mark.parametrize("delay", [0.0, 0.008])
def test_a_point_is_placed_where_it_is_at_the_stamp(delay: float) -> None:
    ray, twist = np.array([[0.1, -0.2]]), np.array([0.3, 0.0, 0.8])
    P, direction = placed(ray, np.array([2.0]), np.array([delay]), AT, twist)
    at_row = MOUNT.transform(np.array([[0.2, -0.4, 2.0]]))
    expected = SE3.from_se2(SE2.exp(twist * delay)).transform(at_row)
    np.testing.assert_allclose(P, expected, atol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(direction), np.linalg.norm([0.1, -0.2, 1.0]), atol=1e-9)
