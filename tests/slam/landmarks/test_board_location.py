import cv2
import numpy as np
import pytest

from slam.landmarks.board_location import BoardGridError, grid_board, locate_board
from slam.landmarks.boards import Board, BoardView
from slam.landmarks.corner_pose import EXCESS, Corners, refined
from slam.landmarks.sighting import square
from slam.messages import CameraInfo
from slam.se3 import SE3

CAMERA = CameraInfo(640, 480, np.array([[600.0, 0, 320], [0, 610.0, 240], [0, 0, 1]]), np.array([0.05, -0.1, 0.001, -0.001, 0.0]))
BOARD = Board("charuco", 5, 7, 0.04, 0.02)
T_CAMERA_BOARD = SE3.from_xyz_rpy((-0.1, -0.12, 0.6), (0.5, -0.2, 0.3))


def seen(T_camera: SE3, points: np.ndarray) -> np.ndarray:
    turn, place = cv2.Rodrigues(T_camera.R.copy())[0], T_camera.t.copy()
    return cv2.projectPoints(points, turn, place, CAMERA.K, CAMERA.D)[0].reshape(-1, 2)


def view(noise: float, seed: int = 0) -> BoardView:
    pixels = seen(T_CAMERA_BOARD, BOARD.corners) + np.random.default_rng(seed).normal(0.0, noise, (len(BOARD.corners), 2))
    return BoardView(np.arange(len(pixels)), pixels)


def test_exact_corners_give_the_exact_pose() -> None:
    found = locate_board(BOARD, view(0.0), CAMERA)
    assert found is not None
    assert found.excess == 0.0
    np.testing.assert_allclose((found.T_map_camera @ T_CAMERA_BOARD).matrix(), np.eye(4), atol=1e-6)


@pytest.mark.parametrize("noise", [0.1, 0.5, 2.0])
def test_the_covariance_covers_the_error_however_much_the_corners_disagree(noise: float) -> None:
    squares = []
    for seed in range(40):
        found = locate_board(BOARD, view(noise, seed), CAMERA)
        assert found is not None
        off = (found.T_map_camera.inverse() @ T_CAMERA_BOARD.inverse()).log()
        squares.append(off @ np.linalg.solve(found.covariance, off))
    assert 2.0 < np.mean(squares) < 14.0


def test_corners_that_show_something_else_do_not_count() -> None:
    spoilt = view(0.1)
    spoilt.pixels[:5] += 40.0
    found = locate_board(BOARD, spoilt, CAMERA)
    assert found is not None
    assert found.fits.tolist() == [False] * 5 + [True] * (len(spoilt.pixels) - 5)
    assert np.linalg.norm((found.T_map_camera @ T_CAMERA_BOARD).t) < 0.002


def test_corners_at_random_are_no_board() -> None:
    pixels = np.random.default_rng(0).uniform(0.0, 480.0, (24, 2))
    assert locate_board(BOARD, BoardView(np.arange(24), pixels), CAMERA) is None


def test_corners_on_a_line_tell_nothing() -> None:
    whole = view(0.0)
    assert locate_board(BOARD, BoardView(whole.numbers[:4], whole.pixels[:4]), CAMERA) is None


def test_a_lone_group_has_no_excess() -> None:
    corners = Corners(square(0.1)[None], np.random.default_rng(0).uniform(-0.1, 0.1, (1, 4, 2)), np.tile(1e-8 * np.eye(2), (1, 4, 1, 1)))
    found = refined(corners, SE3(t=np.array([0.0, 0.0, -1.0])))
    assert found.excess == 0.0 < EXCESS


def test_a_grid_of_markers_lies_as_opencv_s_does() -> None:
    ours = grid_board(5, 7, 0.04, 0.01, "DICT_6X6_250", 3)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_6X6_250)
    theirs = cv2.aruco.GridBoard((5, 7), 0.04, 0.01, dictionary, np.arange(3, 38, dtype=np.int32))
    assert list(ours.markers) == list(range(3, 38))
    for marker, corners in zip(ours.markers.values(), theirs.getObjPoints(), strict=True):
        np.testing.assert_allclose(marker.corners, corners, atol=1e-7)


@pytest.mark.parametrize("wrong", [(0, 7, 0.04, 0.01), (5, 7, 0.0, 0.01), (5, 7, 0.04, -1.0)])
def test_a_grid_that_cannot_be_is_refused(wrong: tuple) -> None:
    with pytest.raises(BoardGridError, match="above 0"):
        grid_board(*wrong, "DICT_6X6_250")
