"""Covariances of poses from one frame to another, against samples and the adjoint."""

from __future__ import annotations

import numpy as np

from slam.mapping.uncertainty import composed, from_body, inverted, to_body
from slam.se2 import SE2

T_A_B = SE2(0.7, -1.3, 2.1)
C = np.array([[4.0, 1.0, 0.5], [1.0, 3.0, -0.4], [0.5, -0.4, 2.0]]) * 1e-6


def test_the_inverse_of_a_pose_scatters_as_its_covariance_says() -> None:
    twists = np.random.default_rng(0).multivariate_normal(np.zeros(3), C, 20000)
    errors = np.array([(T_A_B @ (T_A_B @ SE2.exp(twist)).inverse()).log() for twist in twists])
    np.testing.assert_allclose(np.cov(errors.T), inverted(C, T_A_B), atol=0.04 * np.abs(inverted(C, T_A_B)).max())


def test_composition_carries_the_first_pose_into_the_last_body() -> None:
    Ad = T_A_B.inverse().adjoint()
    np.testing.assert_allclose(composed(C, T_A_B, 2.0 * C), Ad @ C @ Ad.T + 2.0 * C)


def test_turning_into_the_body_and_back_changes_nothing() -> None:
    np.testing.assert_allclose(from_body(to_body(C, T_A_B), T_A_B), C)
    R = np.eye(3)
    R[:2, :2] = T_A_B.rotation()
    np.testing.assert_allclose(from_body(C, T_A_B), R @ C @ R.T)
