import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.evaluation.poses import compose
from slam.motion.motion_noise import MotionNoise
from slam.se2 import SE2, FloatArray

NOISE = MotionNoise()
steps = st.builds(SE2, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-1.0, 1.0))
poses = st.builds(SE2, st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(-3.1, 3.1))
covariances = st.integers(0, 2**32 - 1).map(lambda seed: np.random.default_rng(seed).normal(0.0, 0.1, (3, 4))).map(lambda B: B @ B.T)


def assert_covariance(P: FloatArray) -> None:
    np.testing.assert_allclose(P, P.T, atol=1e-12)
    assert np.linalg.eigvalsh(P).min() > -1e-12


def test_standing_still_adds_nothing() -> None:
    assert not NOISE.covariance(SE2()).any()


def test_a_metre_and_a_radian_cost_what_the_parameters_say() -> None:
    P = MotionNoise(distance_per_distance=0.1, yaw_per_distance=0.2, yaw_per_yaw=0.3).covariance(SE2(1.0, 0.0, 1.0))
    np.testing.assert_allclose(np.diag(P), [0.01, 0.01, 0.04 + 0.09])


def test_the_floor_is_there_without_motion() -> None:
    P = MotionNoise(distance_floor=0.01, yaw_floor=0.02).with_floor(SE2())
    np.testing.assert_allclose(P, np.diag([1e-4, 1e-4, 4e-4]))


@given(covariances, poses, steps)
def test_what_is_propagated_is_a_covariance_and_does_not_shrink(P: FloatArray, pose: SE2, step: SE2) -> None:
    propagated = NOISE.propagate(P, pose, step)
    assert_covariance(propagated)
    assert propagated[2, 2] >= P[2, 2] - 1e-12


@given(covariances, poses)
def test_without_motion_nothing_changes(P: FloatArray, pose: SE2) -> None:
    np.testing.assert_allclose(NOISE.propagate(P, pose, SE2()), P, atol=1e-12)


def test_a_heading_error_swings_across_the_way_driven() -> None:
    exact = MotionNoise(0.0, 0.0, 0.0)
    P = exact.propagate(np.diag([0.0, 0.0, 0.01]), SE2(yaw=math.pi / 2), SE2(2.0))  # north by two metres
    np.testing.assert_allclose(np.diag(P), [0.04, 0.0, 0.01], atol=1e-12)


def test_propagation_matches_the_moments_of_samples() -> None:
    noise, rng, P = MotionNoise(0.05, 0.05, 0.05), np.random.default_rng(3), np.diag([4e-4, 1e-4, 4e-4])
    start, step = SE2(1.0, 2.0, 0.7), SE2(0.6, 0.05, 0.3)
    starts = rng.multivariate_normal(start.as_array(), P, 200_000)
    moves = rng.multivariate_normal(step.as_array(), noise.covariance(step), 200_000)
    np.testing.assert_allclose(noise.propagate(P, start, step), np.cov(compose(starts, moves).T), rtol=0.03, atol=1e-5)


@pytest.mark.parametrize("yaw", [0.0, 1.0, 2.5])
def test_noise_of_a_step_turns_with_the_robot(yaw: float) -> None:
    step = SE2(0.5, 0.0, 0.2)
    R = SE2(yaw=yaw).rotation()
    P = NOISE.propagate(np.zeros((3, 3)), SE2(yaw=yaw), step)
    np.testing.assert_allclose(P[:2, :2], R @ NOISE.covariance(step)[:2, :2] @ R.T, atol=1e-15)
