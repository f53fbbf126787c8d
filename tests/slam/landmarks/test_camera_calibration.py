import math

import cv2
import numpy as np
import pytest

from slam.errors import ParameterError
from slam.landmarks.boards import Board, BoardFinder, BoardView
from slam.landmarks.camera_calibration import CalibrationError, ViewChoice, calibrate
from slam.se3 import SE3

SIZE = (640, 480)
K = np.array([[500.0, 0.0, 315.0], [0.0, 502.0, 245.0], [0.0, 0.0, 1.0]])
D = np.array([-0.1, 0.05, 0.001, -0.002, 0.0])
BOARD = Board()


def view(
    roll: float, pitch: float, yaw: float, xyz: tuple[float, float, float] = (-0.09, -0.12, 0.45), noise: float = 0.0, seed: int = 0
) -> BoardView:
    pose = SE3.from_xyz_rpy(xyz, (roll, pitch, yaw))
    pixels = cv2.projectPoints(BOARD.corners, cv2.Rodrigues(np.array(pose.R))[0], np.array(pose.t), K, D)[0].reshape(-1, 2)
    return BoardView(np.arange(len(pixels)), pixels + np.random.default_rng(seed).normal(0.0, noise, pixels.shape))


TILTED = [view(0.0, 0.0, 0.0), view(0.5, 0.0, 0.1), view(-0.4, 0.3, 0.0), view(0.1, -0.5, 0.2), view(0.2, 0.5, -0.4)]


def drawn(board: Board, cell: int = 6) -> np.ndarray:
    return np.pad(np.kron(np.where(board.cells()[0], 0, 255).astype(np.uint8), np.ones((cell, cell), np.uint8)), 40, constant_values=255)


@pytest.mark.parametrize(
    "board", [Board(), Board(columns=6, rows=4, dictionary="DICT_4X4_50", square=0.05, marker=0.025, first=3), Board("chessboard", 9, 6)]
)
def test_a_drawn_board_is_found_where_it_is_drawn(board: Board) -> None:
    cell = 6 if board.kind == "charuco" else 40
    found = BoardFinder(board).find(drawn(board, cell))
    assert found is not None
    assert len(found.numbers) == (board.columns - 1) * (board.rows - 1)
    expected = board.corners[:, :2] / board.cells()[1] * cell + 40 - 0.5
    turned = expected[::-1]  # a chessboard looks alike from below
    assert min(np.abs(found.pixels - expected).max(), np.abs(found.pixels - turned).max()) < 0.05


def test_a_board_that_is_there_twice_is_not_used() -> None:
    once = drawn(BOARD, 3)
    assert BoardFinder(BOARD).find(once) is not None
    assert BoardFinder(BOARD).find(np.hstack([once, once])) is None


def test_a_mirrored_board_is_recognised_as_one() -> None:
    finder = BoardFinder(BOARD)
    assert finder.mirrored(np.ascontiguousarray(drawn(BOARD, 3)[:, ::-1]))
    assert not finder.mirrored(drawn(BOARD, 3))


@pytest.mark.parametrize(
    ("changed", "problem"),
    [
        ({"columns": 2}, "columns = 2; must be 3 to 100 squares"),
        ({"marker": 0.04}, r"marker = 0\.04; must be smaller than a square, 0\.036 m"),
        ({"dictionary": "4X4_1"}, "a name such as"),
        ({"dictionary": "DICT_4X4_50", "first": 40}, "first = 40; must be 33 at most"),
    ],
)
def test_a_board_that_cannot_be_is_refused(changed: dict, problem: str) -> None:
    with pytest.raises(ParameterError, match=problem):
        BoardFinder(Board(**changed))


def test_a_marker_that_is_no_simple_part_of_a_square_cannot_be_drawn() -> None:
    with pytest.raises(ParameterError, match=r"a simple part of the square 0\.036 m to be drawn, such as 0\.0288"):
        Board(marker=0.02713).cells()


def test_exact_views_give_the_camera_back() -> None:
    found = calibrate(BOARD, TILTED, SIZE)
    np.testing.assert_allclose(found.camera.K, K, atol=0.05)
    np.testing.assert_allclose(found.camera.D[:4], D[:4], atol=1e-3)
    assert found.rms < 1e-3


def test_deviations_cover_the_errors_of_noisy_views() -> None:
    rng = np.random.default_rng(4)
    turns = rng.uniform(-0.5, 0.5, (14, 3))
    places = rng.uniform((-0.2, -0.2, 0.35), (0.05, 0.05, 0.6), (14, 3))
    noisy = [view(*turn, xyz=tuple(place), noise=0.1, seed=k) for k, (turn, place) in enumerate(zip(turns, places, strict=True))]
    found = calibrate(BOARD, noisy, SIZE)
    off = np.array([found.camera.K[0, 0] - 500.0, found.camera.K[1, 1] - 502.0, found.camera.K[0, 2] - 315.0, found.camera.K[1, 2] - 245.0])
    assert np.all(np.abs(off) < 4.0 * found.deviations)
    assert found.rms == pytest.approx(0.1 * math.sqrt(2.0), rel=0.15)


def test_a_view_that_fits_badly_is_left_out() -> None:
    bad = view(0.3, 0.3, 0.3)
    bad = BoardView(bad.numbers, bad.pixels + np.random.default_rng(1).normal(0.0, 6.0, bad.pixels.shape))
    assert calibrate(BOARD, [*TILTED, bad], SIZE).used == (0, 1, 2, 3, 4)


def test_two_views_are_too_few() -> None:
    with pytest.raises(CalibrationError, match=r"2 usable views of the charuco of 5 x 7 squares .*; 3 or more are needed"):
        calibrate(BOARD, TILTED[:2], SIZE)


def test_views_that_are_all_parallel_do_not_tell_the_focal_length() -> None:
    parallel = [view(0.0, 0.0, 0.1 * k, (-0.1 + 0.01 * k, -0.1, 0.45), noise=0.05, seed=k) for k in range(5)]
    with pytest.raises(CalibrationError, match="show the board tilted to several sides"):
        calibrate(BOARD, parallel, SIZE)


def test_of_a_film_only_views_count_that_stand_still_and_are_new() -> None:
    choice = ViewChoice(BOARD, SIZE, film=True)
    assert not choice.add(TILTED[0])
    assert choice.add(TILTED[0])
    assert not choice.add(TILTED[0])
    assert not choice.add(TILTED[1])
    assert choice.add(TILTED[1])
    assert len(choice.views) == 2
