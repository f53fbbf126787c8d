"""Whatever is wrong: one line that says what and what would be right, exit code 2, and nothing written."""

import re

import pytest

from scripts.cli import main


@pytest.fixture
def refused(capsys, tmp_path):
    """Runs `twin run` with arguments that it must refuse before it writes anything; returns its one line."""

    def run(*argv: str) -> str:
        out = tmp_path / "refused"
        assert main(["run", "--out", str(out), *argv]) == 2
        printed, line = capsys.readouterr()
        assert printed == ""
        assert re.fullmatch(r"twin: [^\n]+\n", line)
        assert not out.exists()
        return line

    return run


@pytest.mark.parametrize(
    ("argv", "problem"),
    [
        ("--world aruco_rom", "no world 'aruco_rom'; available: apartment, aruco_room, "),
        ("--world aruco_room:colour=red", "option colour: write option=value; options: size"),
        ("--world nowhere.toml", "nowhere.toml: cannot be read: No such file or directory"),
        ("--pipeline lidr", "no pipeline 'lidr'; available: amcl, fusion, icp_odometry, lidar, lidar_slam, "),
        ("--policy fly", "no policy 'fly'; available: explore, goal, none, "),
        ("--robot r2d2", "no robot 'r2d2'; available: ev3, kinematic, replay, sim"),
        ("--robot sim:corridor", "--robot sim takes no 'corridor'; a world is chosen by --world"),
        ("--robot replay", "--robot replay needs a recording"),
        ("--robot replay:", "--robot replay needs a recording"),
        ("--robot replay:nowhere", "recording nowhere: cannot be read: No such file or directory"),
        ("--spec nowhere.toml", "robot specification nowhere.toml: cannot be read: No such file or directory"),
        ("--duration nan", "--duration nan: give a positive number of seconds"),
        ("--duration 0", "--duration 0: give a positive number of seconds"),
        ("--duration -1", "--duration -1: give a positive number of seconds"),
        ("--duration inf", "--duration inf: give a positive number of seconds"),
        ("--seed -1", "the seed must be 0 or above, got -1"),
        ("--start nan 0 0", "--start nan 0 0: give finite numbers"),
        ("--start 1e9 0 0", "within 100 m of the map's origin"),
        ("--start 0 0 inf", "--start 0 0 inf: give finite numbers"),
        ("--pipeline amcl", "the pipeline 'amcl' localises in a map: give --map"),
        ("--pipeline amcl --map nowhere.yaml", "nowhere.yaml"),
        ("--marker-map nowhere.yaml", "--marker-map: the pipeline 'lidar' does not look at markers; take visual_slam or amcl"),
        ("--camera-info nowhere.yaml", "--camera-info: the pipeline 'lidar' does not look at markers; take visual_slam or amcl"),
        ("--pipeline visual_slam --camera-info nowhere.yaml", "camera file nowhere.yaml: No such file or directory"),
        ("--map nowhere", "--map: the pipeline 'lidar' makes its own map"),
        ("--params nowhere.toml", "--params nowhere.toml: cannot be read: No such file or directory"),
    ],
)
def test_an_option_that_cannot_be(argv, problem, refused):
    assert problem in refused(*argv.split())


@pytest.mark.parametrize(
    ("argv", "problem"),
    [
        ("--policy tour", "a recording cannot be driven: --policy tour needs a live robot; leave it out or use --policy none"),
        ("--world corridor", "--world belongs to the simulation; a recording is what it is, leave the option out"),
        ("--seed 3", "--seed belongs to the simulation"),
        ("--realism ideal", "--realism belongs to the simulation"),
        ("--rays bullet", "--rays belongs to the simulation"),
        ("--spec nowhere.toml", "robot specification nowhere.toml: cannot be read: No such file or directory"),
    ],
)
def test_an_option_that_a_recording_does_not_have(argv, problem, refused, recorded_run):
    assert problem in refused("--robot", f"replay:{recorded_run}", *argv.split())


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("speed = 1", "no parameter 'speed'; available: "),
        ("[map]\ncell_size = 1", "no parameter 'map.cell_size'; available: map.resolution, map.fixed_size"),
        ('[map]\nresolution = "fine"', "Expected `float`, got `str` - at `$.map.resolution`"),
        ("[map]\nresolution = 0", "MapSettings.resolution = 0.0; must be above 0"),
        ("[map]\nresolution = nan", "MapSettings.resolution = nan; must be above 0"),
        ("[map]\nresolution = 1e-9", "cells of 1e-09 m is too large"),
        ("[tracking.matcher]\niterations = 1.5", "Expected `int`, got `float` - at `$.tracking.matcher.iterations`"),
        ("[tracking.search]\nbeams = 0", "Correlative.beams = 0; must be above 0"),
        ("[tracking.noise]\nyaw_floor = -1.0", "MotionNoise.yaw_floor = -1.0; must be above 0"),
        ("map = 3", "'map' must be a table of parameters, not 3"),
        ("parameters = 3", "'parameters' must be a table of parameters, not 3"),
        ("tracking.search_above = {a = 1}", "Expected `float`, got `object` - at `$.tracking.search_above`"),
        ("[map", "not TOML: "),
        ("x = " + "[" * 2000, "not TOML: "),
    ],
)
def test_a_parameter_that_cannot_be(text, problem, refused, tmp_path):
    path = tmp_path / "parameters.toml"
    path.write_text(text)
    assert problem in refused("--params", str(path))


def test_parameters_of_another_pipeline(refused, recorded_run):
    assert "no parameter 'tracking'; available: " in refused("--params", str(recorded_run / "config.toml"), "--pipeline", "odometry")


def test_a_world_file_with_an_error_names_the_line(refused, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('name = "mine"\nstart = [0.0, 0.0, "north"]\n[[wall]]\n')
    assert "mine.toml line 2: start[2] = 'north': must be a number" in refused("--world", str(path))


def cut(content: bytes) -> bytes:
    return content[:2000]


def flipped(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 0xFF]) + content[middle + 1 :]


def beheaded(content: bytes) -> bytes:
    return b"X" + content[1:]


@pytest.mark.parametrize(
    ("spoil", "problem"),
    [
        (cut, "holds no complete chunk of messages"),
        (flipped, r"is corrupt at byte \d+ .*: cut the file there \(head -c \d+\) to use that"),
        (beheaded, "it is no MCAP file"),
        (bytes, "the file is empty"),
    ],
)
def test_a_spoilt_recording(spoil, problem, refused, recorded_run, tmp_path):
    path = tmp_path / "spoilt.mcap"
    path.write_bytes(spoil((recorded_run / "recording.mcap").read_bytes()) if spoil is not bytes else b"")
    assert re.search(problem, refused("--robot", f"replay:{path}"))


def test_the_part_before_a_corrupt_byte_can_be_used_as_the_message_says(refused, recorded_run, tmp_path, caplog):
    path = tmp_path / "spoilt.mcap"
    path.write_bytes(flipped((recorded_run / "recording.mcap").read_bytes()))
    found = re.search(r"head -c (\d+)", refused("--robot", f"replay:{path}"))
    path.write_bytes(path.read_bytes()[: int(found[1])])
    assert main(["run", "--robot", f"replay:{path}", "--out", str(tmp_path / "out")]) == 0
    assert caplog.text.count("was not finished") == 1


def test_a_recording_without_scans(refused, tmp_path, capsys):
    assert main(["run", "--duration", "0.05", "--record", "--out", str(tmp_path / "short")]) == 0
    capsys.readouterr()
    assert "no scans (/scan)" in refused("--robot", f"replay:{tmp_path / 'short'}")


def carmen(x: str = "0", time: str = "3.0") -> str:
    """A short log whose last scan was taken at `x` and `time`."""
    scan = "FLASER 4 1.0 1.0 1.0 1.0 {x} 0 0 {x} 0 0 {time} host {time}\n"
    return "".join(scan.format(x=0, time=t) for t in ("1.0", "2.0")) + scan.format(x=x, time=time)


@pytest.mark.parametrize(
    ("log", "problem"),
    [
        (carmen(x="nan"), "line 3: pose (nan, 0.0, 0.0) is not finite"),
        (carmen(x="1e300"), "line 3: pose (1e+300, 0.0, 0.0) is not finite or beyond 1e+07"),
        (carmen(time="-5.0"), "line 3: stamp -5.0 of scans runs back by 7.000 s; less than 2.0 s would be clamped"),
        (carmen(time="1e9"), "more than 86400 s after the reading before it"),
        ("ODOM 0 0 0 0 0 0 1.0 host 1.0\n", "no FLASER records"),
        ("hello\n", "of no known format"),
    ],
)
def test_a_log_that_makes_no_sense(log, problem, refused, tmp_path):
    path = tmp_path / "log.txt"
    path.write_text(log)
    assert problem in refused("--robot", f"replay:{path}")


def test_a_folder_without_a_recording(refused, tmp_path):
    assert "no recording.mcap in this folder; was the run made with --record?" in refused("--robot", f"replay:{tmp_path}")


@pytest.mark.parametrize("recording", [".", "recording.mcap"])
def test_results_never_go_beside_the_recording_that_is_replayed(recording, recorded_run, capsys):
    before = {path.name: path.read_bytes() for path in recorded_run.iterdir()}
    assert main(["run", "--robot", f"replay:{recorded_run / recording}", "--record", "--out", str(recorded_run)]) == 2
    assert "holds the recording that is replayed; name another folder" in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in recorded_run.iterdir()} == before


@pytest.mark.parametrize("place", ["file", "file/below"])
def test_a_place_that_cannot_be_written(place, tmp_path, capsys):
    (tmp_path / "file").write_text("mine")
    assert main(["run", "--duration", "1", "--out", str(tmp_path / place)]) == 2
    line = capsys.readouterr().err
    assert re.fullmatch(r"twin: cannot write .*: (File exists|Not a directory); make room or name another place\n", line)
    assert (tmp_path / "file").read_text() == "mine"


def test_a_pose_that_jumps_is_taken_as_a_reset_of_the_odometry(tmp_path, caplog):
    log = tmp_path / "jump.log"
    log.write_text(carmen(x="1e6"))
    assert main(["run", "--robot", f"replay:{log}", "--pipeline", "odometry", "--out", str(tmp_path / "out")]) == 0
    assert "taken as a reset" in caplog.text
    assert (tmp_path / "out" / "trajectory.tum").read_text()
