"""What is left when a run is killed, interrupted, or runs out of disk: everything until then, nothing half-written."""

import json
import os
import re
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from hardware.errors import RecordingError
from hardware.logs.registry import open_log
from hardware.replay import Replay
from scripts.cli import main
from scripts.runs.folder import RESULTS
from scripts.runs.loop import Loop, RunLog
from slam.map_file import read_map
from slam.mapping.odometry import Odometry
from slam.navigation.policies import Idle
from slam.trajectory_file import read_trajectory

ENDLESS = ["run", "--record", "--duration", "1e6"]
KILLED_AT = 4.6
SUICIDE = """
import os, signal, sys
from pathlib import Path
from hardware.recorder import Recorder
from hardware.registry import backend_class
from hardware.urdf import urdf
from scripts.runs.loop import Loop, RunLog
from slam.navigation.policies import Idle
from slam.pipelines import PIPELINES

def kill(now):
    if now >= float(sys.argv[2]):
        os.kill(os.getpid(), signal.SIGKILL)

robot = backend_class("sim")().build()
with robot, Recorder(robot, Path(sys.argv[1]), urdf(robot.spec)) as recorder:
    Loop(robot, PIPELINES["odometry"]().build(), Idle().build(None), lambda: False, recorder=recorder, progress=kill).run(RunLog())
"""


def start(folder: Path, *argv: str, limit: int | None = None) -> subprocess.Popen[str]:
    """The command as a process of its own, whose files cannot grow beyond `limit` bytes."""

    def restrict() -> None:
        if limit is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    command = [sys.executable, "-m", "scripts.cli", *argv, "--out", str(folder)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=restrict)  # noqa: PLW1509


def wait_for(path: Path, size: int = 1) -> None:
    """Return as soon as the file has that many bytes."""
    for _ in range(3000):
        if path.is_file() and path.stat().st_size >= size:
            return
        time.sleep(0.01)
    pytest.fail(f"{path} did not come")


def leftovers(folder: Path) -> list[str]:
    """Files that are not whole."""
    return [path.name for path in folder.iterdir() if ".part" in path.name]


def test_a_killed_process_loses_less_than_the_last_second(tmp_path):
    killed = subprocess.run([sys.executable, "-c", SUICIDE, str(tmp_path), str(KILLED_AT)], check=False, capture_output=True)
    assert killed.returncode == -signal.SIGKILL, killed.stderr
    assert open_log(tmp_path).span[1] > KILLED_AT - 1.0


def test_a_killed_run_replays(tmp_path, capsys, caplog):
    run = start(tmp_path / "killed", *ENDLESS)
    wait_for(tmp_path / "killed" / "recording.mcap.part", 60_000)
    run.kill()
    run.communicate()
    assert main(["run", "--robot", f"replay:{tmp_path / 'killed'}", "--out", str(tmp_path / "replayed")]) == 0
    assert "was not finished" in caplog.text
    assert "Position was right to" in capsys.readouterr().out
    assert len(read_trajectory(tmp_path / "replayed" / "trajectory_final.tum")) > 5


def test_an_interrupted_run_is_complete_up_to_there(tmp_path):
    run = start(tmp_path, *ENDLESS)
    wait_for(tmp_path / "recording.mcap.part", 40_000)
    run.send_signal(signal.SIGINT)
    out, err = run.communicate()
    assert run.returncode == 130
    assert err == f"twin: interrupted; {tmp_path} holds what there is until then\n"
    assert str(tmp_path / "report.png") in out
    assert {path.name for path in tmp_path.iterdir()} == {*RESULTS, "config.toml", "recording.mcap", "metadata.yaml"}
    final, recording = read_trajectory(tmp_path / "trajectory_final.tum"), open_log(tmp_path)
    assert final.stamps[-1] == pytest.approx(recording.span[1], abs=0.3)
    assert json.loads((tmp_path / "metrics.json").read_text())["frames"] == len(read_trajectory(tmp_path / "trajectory.tum"))


def test_a_second_interruption_leaves_at_once_and_what_is_written_is_whole(tmp_path):
    run = start(tmp_path, *ENDLESS)
    wait_for(tmp_path / "recording.mcap.part", 40_000)
    run.send_signal(signal.SIGTERM)
    wait_for(tmp_path / "trajectory.tum")
    run.send_signal(signal.SIGTERM)
    _, err = run.communicate()
    assert run.returncode == 130
    assert re.fullmatch(r"twin: interrupted.*\n", err)
    assert leftovers(tmp_path) == []
    assert len(read_trajectory(tmp_path / "trajectory.tum")) > 0
    for picture in tmp_path.glob("*.png"):
        with Image.open(picture) as image:
            image.load()


def test_an_interruption_before_the_run_writes_nothing(tmp_path):
    parameters = tmp_path / "slow.toml"
    os.mkfifo(parameters)
    run = start(tmp_path / "out", *ENDLESS, "--params", str(parameters))
    with parameters.open("w"):  # the command reads it now, and waits
        run.send_signal(signal.SIGINT)
        _, err = run.communicate()
    assert (run.returncode, err) == (130, "twin: interrupted\n")
    assert not (tmp_path / "out").exists()


def test_a_full_disk_while_recording_keeps_what_was_recorded_and_estimated(tmp_path):
    run = start(tmp_path, *ENDLESS, limit=100_000)
    _, err = run.communicate()
    assert run.returncode == 2
    assert err == f"twin: recording {tmp_path}: cannot be written on: File too large; what was written stays readable\n"
    assert open_log(tmp_path).span[1] > 1.0
    assert len(read_trajectory(tmp_path / "trajectory_final.tum")) > 5
    assert len(read_map(tmp_path / "map.yaml").wall_points()) > 100
    assert leftovers(tmp_path) == ["recording.mcap.part"]


@pytest.fixture
def disk_of():
    """Sets how large a file can become in this process [bytes]; as before afterwards."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda limit: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_full_disk_while_drawing_keeps_trajectories_and_map(recorded_run, tmp_path, disk_of, capsys):
    disk_of(60_000)
    assert main(["run", "--robot", f"replay:{recorded_run}", "--out", str(tmp_path)]) == 2
    assert capsys.readouterr() == ("", f"twin: cannot write {tmp_path / 'report.png'}: File too large; make room or name another place\n")
    for name in ("trajectory.tum", "trajectory_final.tum", "odometry.tum", "map.pgm", "map.yaml", "metrics.json"):
        assert (tmp_path / name).is_file()
    assert leftovers(tmp_path) == []


@pytest.mark.parametrize(("limit", "written"), [(300, set()), (3_000, {"config.toml"})])
def test_a_full_disk_never_leaves_half_a_file(limit, written, recorded_run, tmp_path, disk_of, capsys):
    disk_of(limit)
    assert main(["run", "--robot", f"replay:{recorded_run}", "--duration", "2", "--out", str(tmp_path)]) == 2
    assert re.fullmatch(r"twin: [^\n]*File too large[^\n]*\n", capsys.readouterr().err)
    assert {path.name for path in tmp_path.iterdir()} == written


def test_a_recording_that_is_spoilt_while_it_replays_keeps_what_was_said_before(recorded_run, tmp_path):
    bag = tmp_path / "recording.mcap"
    bag.write_bytes((recorded_run / "recording.mcap").read_bytes())
    robot, log = Replay(bag).build(), RunLog()
    with bag.open("r+b") as file:
        file.seek(bag.stat().st_size // 2)
        file.write(bytes(64))
    with robot, pytest.raises(RecordingError, match="is corrupt at byte"):
        Loop(robot, Odometry().build(), Idle().build(np.empty((0, 2))), lambda: False).run(log)
    assert len(log.stamps) == len(log.poses) > 50
