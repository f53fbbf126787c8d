import numpy as np
import pytest

from hardware.robot_file import read_robot_file
from scripts.calibrations.square import square_way
from scripts.cli import main

TRUE = (0.028 * 1.005, 0.028 * 0.997, 0.120 * 1.01)
"""What the twin's wheels are when its owner believes in 28 and 120 mm, at the data sheet's errors."""


def test_what_is_found_from_a_recording_is_what_the_twin_is(tmp_path, capsys):
    run = ["run", "--robot", "kinematic", "--pipeline", "odometry", "--record", "--duration", "70", "--out", str(tmp_path / "run")]
    assert main(run) == 0
    robot = tmp_path / "robot.toml"
    assert main(["calibrate", "odometry", "--robot", f"replay:{tmp_path / 'run'}", "--out", str(robot), "--mount"]) == 0
    said = capsys.readouterr().out
    assert "left wheel, radius" in said
    drive = read_robot_file(robot).spec.drive
    assert (*drive.wheel_radii, drive.track) == pytest.approx(TRUE, rel=0.003)
    assert read_robot_file(robot).spec.lidar.T_base_laser.t == pytest.approx([0.03, 0.0, 0.18], abs=0.005)


def test_a_square_is_laid_where_there_is_room_and_tells_what_the_twin_is(tmp_path):
    robot = tmp_path / "robot.toml"
    assert main(["calibrate", "odometry", "--robot", "kinematic", "--square", "1", "--duration", "70", "--out", str(robot)]) == 0
    drive = read_robot_file(robot).spec.drive
    assert (*drive.wheel_radii, drive.track) == pytest.approx(TRUE, rel=0.004)


def test_where_there_is_no_room_a_square_that_fits_is_named(tmp_path, capsys):
    told = ["--robot", "kinematic", "--world", "corridor", "--square", "1", "--out", str(tmp_path / "robot.toml")]
    assert main(["calibrate", "odometry", *told]) == 2
    assert "no room for such a square where the robot stands; --square 0.7 has room" in capsys.readouterr().err


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_a_square_goes_round_once_to_either_side(share):
    way = square_way(2.0, share)
    ends = np.roll(way, -1, axis=0)
    areas = np.cumsum(0.5 * (way[:, 0] * ends[:, 1] - way[:, 1] * ends[:, 0]))
    assert areas.max() == pytest.approx(4.0)
    assert areas[-1] == pytest.approx(0.0)
    assert np.sum(np.hypot(*(ends - way).T)) == pytest.approx(16.0)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["wheels"], "no calibration 'wheels'"),
        (["odometry", "--square", "99"], "between 0.3 and 20"),
        (["odometry", "--duration", "0"], "positive"),
        (["odometry", "--robot", "replay:nowhere"], "nowhere"),
        (["odometry", "--robot", "kinematic", "--duration", "2"], "drive on"),
    ],
)
def test_mistakes_are_one_line(capsys, tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    assert main(["calibrate", *arguments]) == 2
    assert words in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_help_names_what_can_be_calibrated(capsys):
    assert main(["calibrate"]) == 0
    assert "odometry" in capsys.readouterr().out
