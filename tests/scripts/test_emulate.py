import pytest

from hardware.errors import HardwareError
from hardware.replay import Replay
from scripts.cli import main
from scripts.doctor import main as doctor
from scripts.emulate import DELAYS, channel_at
from scripts.errors import UsageError


@pytest.mark.wall_clock
def test_the_doctor_finds_emulated_devices_well(emulate, capsys):
    brick, lidar = emulate()
    assert doctor(["--ev3", brick, "--lidar", lidar, "--wheels"]) == 0
    said = capsys.readouterr().out
    assert "FIX" not in said
    assert "10.0 readings a second" in said
    assert "to the left" in said


def test_the_doctor_says_what_is_missing(capsys):
    assert doctor(["--ev3", "tcp:127.0.0.1:9", "--lidar", "/nonexistent/port"]) == 1
    said = capsys.readouterr().out
    assert said.count("NOT THERE") == 2
    assert "check the address" in said
    assert "plug the device in" in said


@pytest.mark.wall_clock
def test_a_brick_with_ev3dev_is_wired_as_its_file_says(emulate, tmp_path, capsys):
    robot = tmp_path / "robot.toml"
    robot.write_text('[ports]\nleft = "C"\nright = "B"\ngyro = 2\nreversed = true\n')
    brick, lidar = emulate("--ev3", "ev3dev:127.0.0.1:0", "--spec", str(robot))
    assert brick.startswith("ev3dev:127.0.0.1:")
    assert doctor(["--ev3", brick, "--lidar", lidar, "--spec", str(robot), "--wheels"]) == 0
    said = capsys.readouterr().out
    assert "motors at C and B, gyro at 2" in said
    assert "FIX" not in said
    assert doctor(["--ev3", brick, "--lidar", lidar]) == 1
    assert "nothing is plugged into ev3-ports:outA" in capsys.readouterr().out


@pytest.mark.wall_clock
def test_a_brick_with_stock_firmware_is_wired_as_its_file_says(emulate, tmp_path, capsys):
    robot = tmp_path / "robot.toml"
    robot.write_text('[ports]\nleft = "C"\nright = "B"\ngyro = 2\nreversed = true\n')
    brick, lidar = emulate("--spec", str(robot))
    assert doctor(["--ev3", brick, "--lidar", lidar, "--spec", str(robot), "--wheels"]) == 0
    assert "FIX" not in capsys.readouterr().out


def test_delays_are_those_measured():
    usb = sorted(DELAYS["usb"]() for _ in range(999))
    assert usb[499] == pytest.approx(0.0084, rel=0.1)
    assert max(DELAYS["bluetooth"]() for _ in range(999)) <= 0.122


@pytest.mark.parametrize("address", ["", "tcp:127.0.0.1:x"])
def test_an_address_that_is_none_is_an_error(address):
    with pytest.raises((UsageError, HardwareError)):
        channel_at(address)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "--robot", "ev3:tcp:127.0.0.1"], "write --ev3 tcp:127.0.0.1"),
        (["run", "--robot", "ev3", "--seed", "3"], "belongs to the simulation"),
        (["run", "--ev3", "tcp:127.0.0.1"], "belongs to the real robot"),
        (["run", "--robot", "ev3", "--ev3", "tcp:127.0.0.1:9", "--lidar", "tcp:127.0.0.1:9"], "cannot connect"),
        (["run", "--robot", "ev3", "--camera", "raster"], "write usb"),
        (["emulate", "--duration", "-1"], "positive number"),
        (["emulate", "--camera", "camera.pty", "--ev3", "tcp:127.0.0.1:0"], "tcp:HOST:PORT or none"),
        (["emulate", "--world", "nowhere", "--ev3", "tcp:127.0.0.1:0"], "nowhere"),
        (["emulate", "--robot", "kinematic", "--ev3", "ev3dev:192.0.2.1:0"], "no brick with ev3dev at ev3dev:192.0.2.1:0"),
        (["emulate", "--spec", "nowhere.toml"], "nowhere.toml: cannot be read"),
    ],
)
def test_mistakes_are_one_line(capsys, tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    assert words in capsys.readouterr().err


@pytest.mark.wall_clock
def test_a_run_through_the_wire_is_scored_with_the_told_truth(emulate, tmp_path, capsys):
    brick, lidar = emulate("--truth", str(tmp_path / "truth.tum"))
    arguments = ["run", "--robot", "ev3", "--ev3", brick, "--lidar", lidar, "--truth", str(tmp_path / "truth.tum")]
    assert main([*arguments, "--policy", "tour", "--duration", "4", "--out", str(tmp_path / "run")]) == 0
    assert "Position was right to" in capsys.readouterr().out
    assert (tmp_path / "run" / "truth.tum").is_file()


@pytest.mark.wall_clock
def test_the_camera_is_part_of_a_run_through_the_wire(emulate, tmp_path, capsys):
    pytest.importorskip("libusb_package", reason="the vendor's library is not installed")
    brick, lidar, camera = emulate("--camera", "tcp:127.0.0.1:0")
    arguments = ["run", "--robot", "ev3", "--ev3", brick, "--lidar", lidar, "--camera", camera, "--pipeline", "visual_slam", "--record"]
    assert main([*arguments, "--policy", "none", "--duration", "4", "--out", str(tmp_path / "run")]) == 0
    images = [event.message for event in Replay(tmp_path / "run").build().log.events() if event.channel == "images"]
    assert len(images) > 5
    assert all(image.colour.any() for image in images)
    replayed = ["run", "--robot", f"replay:{tmp_path / 'run'}", "--pipeline", "visual_slam", "--out", str(tmp_path / "again")]
    assert main(replayed) == 0
