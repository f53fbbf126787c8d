import math

import numpy as np
import pytest

from slam.errors import ParameterError
from slam.localization.influence import Influence, localizability_matrix
from slam.localization.map_faces import Sight

REACH = 5.6


def sight_of(ranges, gradients=None):
    ranges = np.asarray(ranges, np.float64)
    g = np.tile([1.0, 0.0, 0.0], (len(ranges), 1)) if gradients is None else np.asarray(gradients, np.float64)
    return Sight(ranges, g, np.ones(len(ranges)))


def factors(measured, expected, seen=0.0, covariance=0.0):
    count = len(measured)
    C = covariance * np.eye(3)
    return Influence().factors(np.asarray(measured), sight_of(expected), C, np.full(count, seen), REACH)


def test_a_beam_on_its_wall_is_trusted():
    assert factors([2.0], [2.0])[0] < 0.01


def test_a_beam_that_ends_before_its_wall_is_not():
    assert factors([1.0], [2.0])[0] > 0.99


def test_a_beam_that_passes_through_its_wall_is_not():
    assert factors([3.0], [2.0])[0] > 0.99


def test_whoever_the_camera_sees_takes_trust_from_a_doubtful_beam():
    without, with_person = factors([1.95], [2.0])[0], factors([1.95], [2.0], seen=0.95)[0]
    assert with_person > without + 0.3


def test_an_uncertain_pose_forgives_a_beam():
    assert factors([1.8], [2.0], covariance=0.1**2)[0] < 0.1 < factors([1.8], [2.0])[0]


def test_beams_of_which_the_map_says_nothing_count_as_people():
    np.testing.assert_array_equal(factors([2.0, 3.0], [np.inf, np.inf]), 1.0)


def test_the_formula_of_the_document_holds():
    s, z, P_B = math.hypot(0.02, 0.02), 0.02, 0.05
    r, r_E = 1.96, 2.0
    f_A = math.exp(-0.5 * ((r - r_E) / math.hypot(0.0196, 0.02)) ** 2) / (math.sqrt(math.tau) * math.hypot(0.0196, 0.02))
    phi = [0.5 * (1.0 + math.erf(x / math.sqrt(2.0))) for x in ((r_E - r) / math.hypot(0.0196, 0.02), -r / s)]
    f_B = (phi[0] - phi[1]) / r_E
    known = (1 - P_B) * (1 - z) * f_A
    expected = 1.0 - known / (known + (1 - P_B) * z / REACH + P_B * f_B)
    assert factors([r], [r_E])[0] == pytest.approx(expected, rel=1e-6)


def test_only_walls_enter_the_matrix():
    sight = Sight(np.full(2, 2.0), np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.0]]), np.array([1.0, 0.0]))
    np.testing.assert_allclose(localizability_matrix(sight, np.array([4.0, 9.0])), 4.0 * np.outer([1, 0, 0.5], [1, 0, 0.5]))


def test_shares_are_checked():
    with pytest.raises(ParameterError, match="unseen"):
        Influence(unseen=1.0)
