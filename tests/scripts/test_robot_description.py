"""`--spec robot.toml` means the same to every verb that makes a robot."""

import pytest

from hardware.replay import Replay
from scripts.cli import main


@pytest.fixture
def robot_file(tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text("[drive]\ntrack = 0.15\n[lidar]\nT_base_laser = {xyz = [0.05, 0, 0.2], rpy = [0, 0, 0]}\n")
    return path


def test_a_twin_is_what_the_file_says(robot_file, tmp_path):
    out = tmp_path / "run"
    told = ["--robot", "kinematic", "--spec", str(robot_file)]
    assert main(["run", *told, "--pipeline", "odometry", "--record", "--duration", "2", "--out", str(out)]) == 0
    spec = Replay(out).build().spec
    assert spec.drive.track == pytest.approx(0.15)
    assert spec.lidar.T_base_laser.t.tolist() == pytest.approx([0.05, 0.0, 0.2])


def test_a_comparison_drives_the_robot_of_the_file(robot_file, tmp_path):
    out = tmp_path / "compared"
    told = ["--robot", "kinematic", "--spec", str(robot_file), "--duration", "2", "--pipelines", "odometry", "--out", str(out)]
    assert main(["compare", *told]) == 0
    assert Replay(out / "drive").build().spec.drive.track == pytest.approx(0.15)


@pytest.mark.parametrize(
    "argv",
    [
        ["run"],
        ["compare"],
        ["emulate"],
        ["calibrate", "odometry"],
        ["calibrate", "camera", "--robot", "sim"],
        ["calibrate", "camera", "--robot", "ev3"],
        ["run", "--robot", "ev3"],
    ],
)
def test_a_file_that_is_not_there_is_one_line(argv, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main([*argv, "--spec", "nowhere.toml"]) == 2
    assert "robot specification nowhere.toml: cannot be read" in capsys.readouterr().err
