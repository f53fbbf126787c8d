import math

import numpy as np
import pytest

from slam.localization.fusion_eq14 import fused, gain, moved_along
from slam.se2 import SE2

C = np.array([[0.04, 0.01, 0.0], [0.01, 0.02, 0.002], [0.0, 0.002, 0.01]])
D = np.array([[300.0, 20.0, 5.0], [20.0, 200.0, 10.0], [5.0, 10.0, 400.0]])


def test_the_gain_equals_that_of_the_document():
    np.testing.assert_allclose(gain(D, C, 1.0), np.linalg.solve(D + np.linalg.inv(C), D), atol=1e-12)


@pytest.mark.parametrize(("information", "covariance"), [(np.zeros((3, 3)), C), (D, np.zeros((3, 3)))])
def test_without_a_scan_or_without_doubt_nothing_is_corrected(information, covariance):
    np.testing.assert_allclose(gain(information, covariance, 1.0), 0.0, atol=1e-15)


def test_along_a_corridor_the_prediction_stays():
    across = np.diag([0.0, 500.0, 900.0])
    np.testing.assert_array_equal(gain(across, np.diag([0.04, 0.02, 0.01]), 1.0)[0], 0.0)


def test_the_heading_is_corrected_the_short_way_round():
    P = fused(SE2(0.0, 0.0, math.pi - 0.1), SE2(0.0, 0.0, -math.pi + 0.1), 0.5 * np.eye(3))
    assert abs(P.yaw) == pytest.approx(math.pi)


def test_particles_keep_their_places_about_the_pose():
    P, P_PF, particle = SE2(1.0, 2.0, 0.5), SE2(0.8, 2.1, 0.4), SE2(0.7, 2.3, 0.6)
    moved = SE2.from_array(moved_along(particle.as_array()[None], P, P_PF)[0])
    np.testing.assert_allclose((P.inverse() @ moved).as_array(), (P_PF.inverse() @ particle).as_array(), atol=1e-12)
