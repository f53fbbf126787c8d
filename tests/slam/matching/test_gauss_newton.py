import math
from typing import Any

import numpy as np
import pytest

from slam.grid import GridGeometry, OccupancyGrid
from slam.matching.gauss_newton import GaussNewton
from slam.matching.match import Match
from slam.matching.surface_field import SurfaceField
from slam.se2 import SE2, FloatArray

WEAK = np.diag([1.0, 1.0, 1.0])
"""A prior that hardly pulls [m, rad]."""
ORIGINS = [SE2(-3.0, -3.0), SE2(-2.91, -3.07, 0.0), SE2(-1.0, -4.2, 0.6), SE2(3.5, 2.5, 3.0)]
ABOUT_ORIGIN = GridGeometry(0.05, 140, 140, SE2(-3.5, -3.5))
TRUTH = SE2(0.2, -0.3, 0.4)


def error(match: Match, truth: SE2) -> FloatArray:
    """How far the pose is off, as (x, y, yaw) in the map [m, rad]."""
    pose = match.T_target_source
    return np.array([pose.x - truth.x, pose.y - truth.y, (truth.inverse() @ pose).yaw])


@pytest.fixture(scope="module")
def field(room: Any, make_grid: Any) -> SurfaceField:
    return SurfaceField(make_grid(room.samples(), ABOUT_ORIGIN))


@pytest.mark.parametrize("offset", [0.0, 0.006, 0.0125, 0.019, 0.025, 0.031, 0.0375, 0.044, 0.0499])
def test_planes_are_matched_exactly_wherever_they_lie_in_their_cells(make_walls: Any, make_grid: Any, offset: float) -> None:
    walls = make_walls([(-2, 1.5 + offset, 2, 1.5 + offset), (2 + offset, -1.4, 2 + offset, 1.4), (-2, -1.5 + offset, 2, -1.5 + offset)])
    field = SurfaceField(make_grid(walls.samples(), ABOUT_ORIGIN))
    points = walls.points(TRUTH, angles=np.linspace(-1.2, 1.2, 400))
    x, y = TRUTH.transform(points).T
    inner = points[((x < 1.4) & (x > -1.4)) | (abs(y) < 0.8)]
    match = GaussNewton().match(field, inner, TRUTH @ SE2(0.03, -0.02, 0.02), WEAK, 0.1)
    assert np.abs(error(match, TRUTH)[:2]).max() < 1e-4
    assert abs(error(match, TRUTH)[2]) < 1e-4


@pytest.mark.parametrize(
    "shift", [(0.1, 0.0, 0.0), (0.0, -0.1, 0.0), (0.0, 0.0, 0.1), (-0.1, 0.1, -0.1), (0.07, 0.07, 0.15), (-0.12, -0.05, -0.05)]
)
def test_a_perturbed_guess_comes_back(room: Any, field: SurfaceField, shift: tuple[float, float, float]) -> None:
    match = GaussNewton().match(field, room.points(TRUTH), TRUTH @ SE2(*shift), WEAK, 0.3)
    assert match.converged
    assert match.inliers > 0.99
    assert np.abs(error(match, TRUTH)).max() < 1e-3


@pytest.mark.parametrize("shift", [(0.05, 0.0, 0.0), (0.0, -0.06, 0.05), (-0.05, 0.04, -0.08)])
def test_scan_to_scan_is_the_same_forward_and_inverse(room: Any, make_grid: Any, shift: tuple[float, float, float]) -> None:
    T_a_b = SE2(*shift)
    a, b = room.points(TRUTH), room.points(TRUTH @ T_a_b)
    forward = GaussNewton().match(SurfaceField(make_grid(a, ABOUT_ORIGIN)), b, SE2(), WEAK, 0.2)
    inverse = GaussNewton().match(SurfaceField(make_grid(b, ABOUT_ORIGIN)), a, SE2(), WEAK, 0.2)
    assert np.abs(error(forward, T_a_b)).max() < 3e-3
    assert np.abs(error(inverse, T_a_b.inverse())).max() < 3e-3


@pytest.mark.parametrize("T_map_grid", ORIGINS)
def test_where_the_grid_begins_and_how_it_is_turned_does_not_matter(room: Any, make_grid: Any, T_map_grid: SE2) -> None:
    field = SurfaceField(make_grid(room.samples(), GridGeometry(0.05, 160, 160, T_map_grid)))
    match = GaussNewton().match(field, room.points(TRUTH), TRUTH @ SE2(0.05, -0.05, 0.05), WEAK, 0.2)
    assert np.abs(error(match, TRUTH)).max() < 2e-3


def test_a_turned_grid_gives_the_covariance_in_the_map(make_walls: Any, make_grid: Any) -> None:
    walls = make_walls([(-2.0, 0.5, 2.0, 0.5), (-2.0, -0.5, 2.0, -0.5)])
    field = SurfaceField(make_grid(walls.samples(), GridGeometry(0.05, 160, 160, SE2(0.0, -4.0, math.pi / 4))))
    covariance = GaussNewton().match(field, walls.points(SE2()), SE2(), WEAK, 0.1).covariance
    assert covariance[0, 0] == pytest.approx(1.0, rel=0.1)
    assert covariance[1, 1] < 1e-4


@pytest.fixture(scope="module")
def noisy_matches(room: Any, field: SurfaceField) -> list[Match]:
    """Two hundred scans with ranges off by 1 cm, each from a guess of its own."""
    rng = np.random.default_rng(5)
    guesses = [TRUTH @ SE2(*rng.normal(0.0, [0.02, 0.02, 0.02])) for _ in range(200)]
    return [GaussNewton().match(field, room.points(TRUTH, rng.normal(0.0, 0.01, 682)), guess, WEAK, 0.1) for guess in guesses]


def test_noise_makes_no_bias(noisy_matches: list[Match]) -> None:
    errors = np.array([error(match, TRUTH) for match in noisy_matches])
    assert np.abs(errors.mean(axis=0)).max() < 5e-4
    assert errors.std(axis=0).max() < 2e-3


def test_the_covariance_covers_the_errors_without_drowning_them(noisy_matches: list[Match]) -> None:
    squares = np.array([error(match, TRUTH) @ np.linalg.solve(match.covariance, error(match, TRUTH)) for match in noisy_matches])
    assert np.mean(squares < 7.81) > 0.9  # 95 % of chi-square with three degrees of freedom
    assert squares.mean() > 0.03


def test_the_residual_is_the_noise(noisy_matches: list[Match]) -> None:
    assert np.median([match.rms for match in noisy_matches]) == pytest.approx(0.01, rel=0.35)


def test_a_corridor_keeps_the_prior_along_its_axis(make_walls: Any, make_grid: Any) -> None:
    walls = make_walls([(-3.0, 0.66, 3.0, 0.66), (-3.0, -0.66, 3.0, -0.66)])
    field = SurfaceField(make_grid(walls.samples(), ABOUT_ORIGIN))
    prior = np.diag([0.05**2, 0.05**2, 0.05**2])
    match = GaussNewton().match(field, walls.points(SE2(), angles=np.linspace(0.5, 2.6, 400)), SE2(0.1, 0.03, 0.02), prior, 0.1)
    assert match.T_target_source.x == pytest.approx(0.1, abs=3e-3)
    assert abs(match.T_target_source.y) < 1e-3
    assert match.covariance[0, 0] == pytest.approx(prior[0, 0], rel=0.05)
    assert match.covariance[1, 1] < 0.05 * prior[1, 1]


def test_a_strong_prior_holds_the_guess(room: Any, field: SurfaceField) -> None:
    guess = TRUTH @ SE2(0.05, 0.0, 0.0)
    match = GaussNewton().match(field, room.points(TRUTH), guess, 1e-10 * np.eye(3), 0.1)
    assert np.abs(error(match, guess)).max() < 1e-3


def test_far_points_that_are_not_in_the_map_do_not_pull(room: Any, field: SurfaceField) -> None:
    points = room.points(TRUTH)
    stranger = np.random.default_rng(1).uniform(-0.9, 0.9, (100, 2))
    match = GaussNewton().match(field, np.vstack([points, stranger]), TRUTH @ SE2(0.03, 0.03, 0.03), WEAK, 0.1)
    assert np.abs(error(match, TRUTH)).max() < 5e-3


def test_an_empty_map_leaves_the_guess() -> None:
    field = SurfaceField(OccupancyGrid.empty(ABOUT_ORIGIN))
    match = GaussNewton().match(field, np.ones((10, 2)), TRUTH, WEAK, 0.1)
    assert np.abs(error(match, TRUTH)).max() < 1e-9
    assert match.inliers == 0.0
    np.testing.assert_allclose(match.covariance, WEAK, rtol=1e-6)


def test_no_points_leave_the_guess(field: SurfaceField) -> None:
    match = GaussNewton().match(field, np.empty((0, 2)), TRUTH, WEAK, 0.1)
    assert np.abs(error(match, TRUTH)).max() < 1e-9
    assert match.inliers == 0.0


def test_the_covariance_is_symmetric_and_positive(room: Any, field: SurfaceField) -> None:
    covariance = GaussNewton().match(field, room.points(TRUTH), TRUTH, WEAK, 0.1).covariance
    np.testing.assert_allclose(covariance, covariance.T, atol=1e-12)
    assert np.linalg.eigvalsh(covariance).min() > 0.0


def test_the_answer_is_the_same_bits_every_time(room: Any, field: SurfaceField) -> None:
    first, second = (GaussNewton().match(field, room.points(TRUTH), TRUTH @ SE2(0.05), WEAK, 0.1) for _ in range(2))
    assert first.T_target_source == second.T_target_source
    np.testing.assert_array_equal(first.covariance, second.covariance)
