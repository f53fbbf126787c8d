"""`twin calibrate camera`, from the command line."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from scripts.cli import main
from slam.landmarks.boards import Board
from slam.landmarks.camera_info_file import read_camera_info
from slam.se3 import SE3

WIDTH, HEIGHT = 640, 480
K = np.array([[520.0, 0.0, 322.0], [0.0, 520.0, 236.0], [0.0, 0.0, 1.0]])
POSES = [(0.0, 0.0, 0.1), (0.5, 0.0, 0.0), (-0.5, 0.1, 0.3), (0.1, 0.5, 0.0), (0.2, -0.5, -0.2)]


def photograph(rpy: tuple[float, float, float], shift: float = 0.0) -> np.ndarray:
    """A board on grey, by a camera without distortion."""
    board = Board()
    cells, cell = board.cells()
    fine = np.kron(np.where(cells, 20, 235).astype(np.uint8), np.ones((4, 4), np.uint8))
    pose = SE3.from_xyz_rpy((0.0, 0.0, 0.4 + shift), rpy) @ SE3.from_xyz_rpy((-0.09 + shift, -0.126, 0.0))
    larger = np.array([[4.0, 0.0, 1.5], [0.0, 4.0, 1.5], [0.0, 0.0, 1.0]])
    print_to_board = np.diag([cell / 4, cell / 4, 1.0]) @ np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]])
    H = larger @ K @ np.column_stack([pose.R[:, :2], pose.t]) @ print_to_board
    large = cv2.warpPerspective(fine, H, (4 * WIDTH, 4 * HEIGHT), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=128)
    return cv2.resize(large, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)


@pytest.fixture
def photos(tmp_path: Path) -> Path:
    folder = tmp_path / "photos"
    folder.mkdir()
    for k, rpy in enumerate(POSES):
        cv2.imwrite(str(folder / f"{k}.png"), photograph(rpy))
    return folder


def refused(capsys: pytest.CaptureFixture[str], tmp_path: Path, *argv: str) -> str:
    out = tmp_path / "out"
    assert main(["calibrate", "camera", "--out", str(out), *argv]) == 2
    printed, line = capsys.readouterr()
    assert printed == ""
    assert line.startswith("twin: ")
    assert line.count("\n") == 1
    assert not out.exists()
    return line


def test_photographs_give_the_camera_and_a_picture_of_what_they_cover(photos: Path, tmp_path: Path, capsys) -> None:
    assert main(["calibrate", "camera", "--images", str(photos), "--out", str(tmp_path / "out"), "--distortion", "none"]) == 0
    found = read_camera_info(tmp_path / "out" / "camera.yaml")
    np.testing.assert_allclose(found.K, K, atol=2.5)
    assert "5 views of 5 pictures" in capsys.readouterr().out
    with Image.open(tmp_path / "out" / "coverage.png") as picture:
        assert picture.size == (1650, 704)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["camera.yaml", "coverage.png"]


def test_a_film_in_which_the_board_stands_still_now_and_then_gives_the_same(tmp_path: Path, capsys) -> None:
    writer = cv2.VideoWriter(str(tmp_path / "walk.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 15.0, (WIDTH, HEIGHT))
    for rpy in POSES:
        for k in range(3):
            writer.write(cv2.cvtColor(photograph(rpy, 0.03 * k), cv2.COLOR_GRAY2BGR))
        for _ in range(3):
            writer.write(cv2.cvtColor(photograph(rpy, 0.06), cv2.COLOR_GRAY2BGR))
    writer.release()
    argv = ["calibrate", "camera", "--images", str(tmp_path / "walk.avi"), "--out", str(tmp_path), "--distortion", "none"]
    assert main(argv) == 0
    np.testing.assert_allclose(read_camera_info(tmp_path / "camera.yaml").K, K, atol=5.0)
    assert "views of 10 pictures" in capsys.readouterr().out


def test_opencv_s_photographs_fit_to_a_fifth_of_a_pixel(shared_data: Path, tmp_path: Path, capsys) -> None:
    images = [str(path) for path in sorted((shared_data / "aruco").glob("img_0*.jpg"))]
    assert main(["calibrate", "camera", "--images", *images, "--square", "0.04", "--marker", "0.02", "--out", str(tmp_path)]) == 0
    rms = float(capsys.readouterr().out.split("RMS ")[1].split(" px")[0])
    assert rms <= 0.2
    assert abs(read_camera_info(tmp_path / "camera.yaml").K[0, 0] - 452.5) < 30.0


def test_a_board_that_is_not_there_a_mirrored_one_and_other_sizes_are_said(photos: Path, tmp_path: Path, capsys) -> None:
    argv = ("--images", str(photos))
    assert "no charuco of 5 x 7 squares" in refused(capsys, tmp_path, *argv, "--dictionary", "DICT_4X4_50")
    for path in photos.iterdir():
        cv2.imwrite(str(path), cv2.imread(str(path))[:, ::-1])
    assert "the pictures are mirrored" in refused(capsys, tmp_path, *argv)
    cv2.imwrite(str(photos / "1.png"), np.zeros((240, 320), np.uint8))
    assert "1.png is 320 x 240, 0.png 640 x 480: K belongs to one resolution" in refused(capsys, tmp_path, *argv)


@pytest.mark.parametrize(
    ("argv", "problem"),
    [
        ((), "give either --images with photographs, a folder or a film, or --robot"),
        (("--images", "nowhere.png"), "nowhere.png: no such file"),
        (("--images", "EMPTY"), "no pictures in this folder"),
        (("--images", "TEXT"), "not a picture that can be read"),
        (("--images", "FILM"), "not a film that can be read"),
        (("--robot", "sim", "--world", "nowhere"), "no world 'nowhere'"),
        (("--images", "ONE"), "1 usable views"),
        (("--images", "ONE", "--squares", "2", "7"), "columns = 2; must be 3 to 100"),
    ],
)
def test_what_cannot_be_used_is_said_in_one_line(argv: tuple[str, ...], problem: str, tmp_path: Path, capsys) -> None:
    (tmp_path / "EMPTY").mkdir()
    (tmp_path / "text.png").write_text("no picture")
    (tmp_path / "film.mp4").write_text("no film")
    cv2.imwrite(str(tmp_path / "one.png"), photograph(POSES[0]))
    files = {"EMPTY": "EMPTY", "TEXT": "text.png", "FILM": "film.mp4", "ONE": "one.png"}
    given = [str(tmp_path / files[word]) if word in files else word for word in argv]
    assert problem in refused(capsys, tmp_path, *given)


def test_a_simulated_robot_that_turns_among_boards_finds_its_own_lens(tmp_path: Path) -> None:
    assert main(["calibrate", "camera", "--robot", "kinematic", "--duration", "14", "--out", str(tmp_path), "--distortion", "none"]) == 0
    found = read_camera_info(tmp_path / "camera.yaml")
    np.testing.assert_allclose(found.K, [[612.0, 0.0, 423.5], [0.0, 612.0, 239.5], [0.0, 0.0, 1.0]], atol=4.0)


def test_calibrate_says_what_there_is_to_calibrate(capsys) -> None:
    assert main(["calibrate"]) == 0
    assert "camera" in capsys.readouterr().out
    assert main(["calibrate", "gyro"]) == 2
    assert "no calibration 'gyro'; available: camera, odometry" in capsys.readouterr().err
