"""What holds for every scan matcher of the registry."""

import math

import numpy as np
import pytest

from scripts.bench.still_scans import StillPair, StillScans
from slam.errors import UnknownNameError
from slam.matching.match import Match
from slam.matching.matchers import MATCHERS, ScanMatcher, matcher_settings
from slam.se2 import SE2, wrap_angle

PRIOR = np.diag([0.05**2, 0.05**2, 0.03**2])
WEAK = np.diag([1.0, 1.0, 1.0])
PAIRS = 4
LIMITS = {"icp": (0.06, 4.0), "correlative": (0.05, 1.5)}
"""Largest error of a pair [m, deg] of those that are not as good as the others."""
SHIFTS = [(0.08, 0.0, 0.0), (0.0, -0.08, 0.0), (0.0, 0.0, 0.08), (0.0, 0.0, -0.08), (-0.05, 0.05, -0.05), (0.05, 0.05, 0.05)]


@pytest.fixture(scope="module", params=MATCHERS)
def matcher(request: pytest.FixtureRequest) -> ScanMatcher:
    return MATCHERS[request.param]()


@pytest.fixture(scope="module")
def limits(request: pytest.FixtureRequest, matcher: ScanMatcher) -> tuple[float, float]:
    name = next(name for name, kind in MATCHERS.items() if isinstance(matcher, kind))
    return LIMITS.get(name, (0.025, 0.6))


@pytest.fixture(scope="module")
def pairs() -> list[StillPair]:
    found = StillScans("aruco_room").pairs(3, (0.05, 0.3), (0.0, 0.2))
    return [next(found) for _ in range(PAIRS)]


def assert_near(match: Match, truth: SE2, limits: tuple[float, float]) -> None:
    error = truth.inverse() @ match.T_target_source
    assert math.hypot(error.x, error.y) < limits[0]
    assert math.degrees(abs(error.yaw)) < limits[1]


@pytest.mark.parametrize("shift", SHIFTS)
def test_a_perturbed_guess_comes_back_to_the_truth(
    matcher: ScanMatcher, limits: tuple[float, float], pairs: list[StillPair], shift: tuple[float, float, float]
) -> None:
    for pair in pairs:
        match = matcher.register(pair.source, pair.target, pair.T_target_source @ SE2(*shift), WEAK)
        assert_near(match, pair.T_target_source, limits)


def test_the_inverse_pair_gives_the_inverse_answer(matcher: ScanMatcher, limits: tuple[float, float], pairs: list[StillPair]) -> None:
    for pair in pairs:
        truth = pair.T_target_source.inverse()
        match = matcher.register(pair.target, pair.source, truth @ SE2(0.03, 0.02, -0.03), WEAK)
        assert_near(match, truth, limits)


def test_the_covariance_is_a_covariance_that_covers_the_error(matcher: ScanMatcher, pairs: list[StillPair]) -> None:
    for pair in pairs:
        T = pair.T_target_source
        match = matcher.register(pair.source, pair.target, T @ SE2(0.03, -0.02, 0.02), PRIOR)
        np.testing.assert_allclose(match.covariance, match.covariance.T, atol=1e-12)
        assert np.linalg.eigvalsh(match.covariance).min() > 0.0
        assert np.linalg.eigvalsh(PRIOR - match.covariance).min() > -1e-9
        error = match.T_target_source.as_array() - T.as_array()
        error[2] = wrap_angle(error[2])
        assert error @ np.linalg.solve(match.covariance, error) < 40.0


def test_a_room_is_localizable_and_a_corridor_is_not_along_its_axis(matcher: ScanMatcher, pairs: list[StillPair]) -> None:
    match = matcher.register(pairs[0].source, pairs[0].target, pairs[0].T_target_source, PRIOR)
    assert match.localizability.weakest < 0.01
    corridor = StillScans("corridor")
    lidar, middle = corridor.lidar(np.random.default_rng(1)), SE2(7.0, 0.05, 0.3)
    source, target = corridor.points(lidar, middle @ SE2(0.1)), corridor.points(lidar, middle)
    guess = SE2(0.16, 0.01, 0.01)
    match = matcher.register(source, target, guess, PRIOR)
    assert match.localizability.weakest > 0.05
    assert abs(math.remainder(match.localizability.axis + middle.yaw, math.pi)) < 0.05
    along = np.array([math.cos(middle.yaw), -math.sin(middle.yaw)])
    moved = match.T_target_source.as_array()[:2] - [guess.x, guess.y]
    assert abs(moved @ along) < 0.05  # the prior decides
    assert along @ match.covariance[:2, :2] @ along > 0.02**2


def test_the_order_of_the_points_hardly_matters(matcher: ScanMatcher, pairs: list[StillPair]) -> None:
    pair, rng = pairs[0], np.random.default_rng(0)
    guess = pair.T_target_source @ SE2(0.03, 0.0, 0.03)
    straight = matcher.register(pair.source, pair.target, guess, PRIOR)
    shuffled = matcher.register(rng.permutation(pair.source), rng.permutation(pair.target), guess, PRIOR)
    error = straight.T_target_source.inverse() @ shuffled.T_target_source
    assert max(abs(error.x), abs(error.y)) < 0.006
    assert abs(error.yaw) < math.radians(0.3)


@pytest.mark.parametrize(
    ("source", "target"),
    [
        (np.empty((0, 2)), np.ones((9, 2))),
        (np.ones((9, 2)), np.empty((0, 2))),
        (np.full((9, 2), np.nan), np.arange(18.0).reshape(9, 2)),
        (np.arange(18.0).reshape(9, 2), np.full((9, 2), np.nan)),
        (np.zeros((9, 2)), np.zeros((9, 2))),
        (np.full((9, 2), 0.5), np.full((9, 2), 90.0)),
    ],
    ids=["no source", "no target", "source of nan", "target of nan", "all in one place", "far apart"],
)
def test_what_decides_nothing_leaves_a_finite_answer_near_the_guess(matcher: ScanMatcher, source: np.ndarray, target: np.ndarray) -> None:
    guess = SE2(0.1, 0.2, 0.3)
    match = matcher.register(source, target, guess, PRIOR)
    assert np.isfinite(match.T_target_source.as_array()).all()
    assert not np.isnan(match.covariance).any()
    assert 0.0 <= match.inliers <= 1.0


def test_the_answer_is_the_same_bits_every_time(matcher: ScanMatcher, pairs: list[StillPair]) -> None:
    first, second = (matcher.register(pairs[0].source, pairs[0].target, SE2(), WEAK) for _ in range(2))
    assert first.T_target_source == second.T_target_source
    np.testing.assert_array_equal(first.covariance, second.covariance)


def test_a_name_that_is_not_there_lists_those_that_are() -> None:
    with pytest.raises(UnknownNameError, match="no matcher 'magic'; available: correlative, gauss_newton, icp, ndt, plicp"):
        matcher_settings("magic")
