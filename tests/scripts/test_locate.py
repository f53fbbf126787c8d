"""`twin locate`, from the command line, on photographs and on a drawn board."""

import csv
from pathlib import Path

import cv2
import numpy as np
import pytest

from scripts.cli import main
from slam.landmarks.board_location import grid_board
from slam.landmarks.marker_map_file import write_marker_map

FLAT = """image_width: 640
image_height: 480
camera_matrix: {rows: 3, cols: 3, data: [600.0, 0, 319.5, 0, 600.0, 239.5, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}
"""


@pytest.fixture
def camera(tmp_path: Path) -> Path:
    path = tmp_path / "camera.yaml"
    path.write_text(FLAT)
    return path


@pytest.fixture
def photograph(tmp_path: Path) -> Path:
    """A grid of 4 x 3 markers of 0.04 m, 0.01 m apart, seen straight on from 0.6 m: a millimetre is a pixel."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_6X6_250)
    board = cv2.aruco.GridBoard((4, 3), 0.04, 0.01, dictionary).generateImage((190, 140), None, 0, 1)
    image = np.full((480, 640), 255, np.uint8)
    image[100:240, 200:390] = board
    path = tmp_path / "photo.png"
    cv2.imwrite(str(path), image)
    return path


def poses(folder: Path) -> dict[str, dict[str, str]]:
    with (folder / "poses.csv").open() as file:
        return {row["what"]: row for row in csv.DictReader(file)}


def refusal(capsys, *argv: str) -> str:
    assert main(["locate", *argv]) == 2
    return capsys.readouterr().err


def test_a_board_of_markers_is_found_where_it_is_and_drawn(photograph: Path, camera: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    options = ["--board", "grid", "--squares", "4", "3", "--marker", "0.04", "--gap", "0.01", "--out", str(out)]
    assert main(["locate", str(photograph), "--camera-info", str(camera), *options]) == 0
    board = poses(out)["board"]
    at = [float(board[name]) for name in "xyz"]
    np.testing.assert_allclose(at, [-0.12, -0.14, 0.6], atol=0.003)
    np.testing.assert_allclose([float(board[f"r{name}"]) for name in "xyz"], 0.0, atol=0.02)
    assert (board["corners"], board["used"]) == ("48", "48")
    there = [float(poses(out)["camera"][name]) for name in "xyz"]
    np.testing.assert_allclose(there, [0.12, 0.14, -0.6], atol=0.02)
    drawn = cv2.imread(str(out / "photo_axes.png"))
    assert drawn.shape == (480, 640, 3)
    assert np.any(drawn[..., 2].astype(int) - drawn[..., 1] > 100)


def test_a_marker_map_and_lone_markers_tell_the_same(photograph: Path, camera: Path, tmp_path: Path) -> None:
    write_marker_map(tmp_path / "map.yaml", grid_board(4, 3, 0.04, 0.01, "DICT_6X6_250"))
    common = ["locate", str(photograph), "--camera-info", str(camera)]
    assert main([*common, "--marker-map", str(tmp_path / "map.yaml"), "--out", str(tmp_path / "a")]) == 0
    assert main([*common, "--marker", "0.04", "--out", str(tmp_path / "b")]) == 0
    whole, lone = poses(tmp_path / "a")["map"], poses(tmp_path / "b")
    assert len(lone) == 12
    assert float(lone["marker 0"]["x"]) == pytest.approx(float(whole["x"]) + 0.02, abs=0.003)


def test_opencv_s_photographs_of_boards_are_located_with_opencv_s_camera_files(shared_data: Path, tmp_path: Path) -> None:
    folder = shared_data / "aruco"
    board = ["--board", "charuco", "--squares", "5", "7", "--square", "0.04", "--marker", "0.02"]
    camera = ["--camera-info", str(folder / "tutorial_camera_charuco.yml")]
    assert main(["locate", str(folder / "choriginal.jpg"), *camera, *board, "--out", str(tmp_path)]) == 0
    found = poses(tmp_path)["board"]
    assert int(found["used"]) >= 22
    assert float(found["rms_px"]) < 0.5


def test_what_is_missing_or_wrong_is_said(photograph: Path, camera: Path, tmp_path: Path, capsys) -> None:
    common = [str(photograph), "--camera-info", str(camera), "--out", str(tmp_path)]
    assert "give --marker" in refusal(capsys, *common)
    assert "nothing found" in refusal(capsys, *common, "--marker", "0.04", "--dictionary", "DICT_APRILTAG_36h11")
    assert "no such file" in refusal(capsys, str(tmp_path / "none.png"), "--camera-info", str(camera), "--marker", "0.04")
    write_marker_map(tmp_path / "map.yaml", grid_board(4, 3, 0.04, 0.01, "DICT_6X6_250"))
    assert "give one" in refusal(capsys, *common, "--marker-map", str(tmp_path / "map.yaml"), "--board", "grid")
    small = tmp_path / "small.png"
    cv2.imwrite(str(small), np.full((240, 320), 255, np.uint8))
    assert "0.5 times as wide" in refusal(capsys, str(small), "--camera-info", str(camera), "--marker", "0.04")
