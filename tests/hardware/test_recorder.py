"""Recording: what comes back, and what is left when it ends badly."""

import resource
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hardware.errors import RecordingError
from hardware.logs.log import Event
from hardware.logs.registry import open_log
from hardware.recorder import Recorder
from hardware.replay import Replay
from slam.messages import Imu, Twist
from slam.se2 import SE2


def record(body, folder) -> None:
    with body, Recorder(body, folder, "<robot/>") as recorder:
        while body.clock.sleep_until(np.inf):
            body.read()
            recorder.flush()


def frames(body, start=0.0, dt=0.05):
    """Frames of the loop that serves every body, and the twists it was given."""
    found, t = [], start
    with body:
        while body.clock.sleep_until(t):
            found.append((body.read(), body.drive(Twist())))
            t = round(t + dt, 9)
    return found


def same_scan(one, two):
    same_arrays = np.array_equal(one.ranges, two.ranges, equal_nan=True) and np.array_equal(one.angles, two.angles)
    rest = [(scan.stamp, scan.time_increment, scan.range_min, scan.range_max, scan.T_base_laser) for scan in (one, two)]
    return same_arrays and rest[0] == rest[1]


def test_a_recording_gives_the_same_frames_bit_for_bit(make_body, tmp_path):
    record(make_body(), tmp_path)
    original, replayed = frames(make_body(), 0.02), frames(Replay(tmp_path).build(), 0.02)
    assert len(original) == len(replayed)
    for (one, twist), (two, recorded_twist) in zip(original, replayed, strict=True):
        assert (one.stamp, one.odometry, one.imu, twist) == (two.stamp, two.odometry, two.imu, recorded_twist)
        assert len(one.scans) == len(two.scans)
        assert all(same_scan(*pair) for pair in zip(one.scans, two.scans, strict=True))


def test_a_recording_brings_its_robot(make_body, tmp_path):
    body = make_body()
    record(body, tmp_path)
    assert Replay(tmp_path).build().spec == body.spec


def test_a_recording_starts_on_the_clock_when_the_recorder_does(make_body, tmp_path):
    body = make_body()
    record(body, tmp_path)
    assert Replay(tmp_path).build().clock.now() == body.span[0]


def test_a_finished_recording_has_only_its_final_names(make_body, tmp_path):
    record(make_body(), tmp_path / "new" / "folder")
    assert sorted(file.name for file in (tmp_path / "new" / "folder").iterdir()) == ["metadata.yaml", "recording.mcap"]


def test_closing_twice_is_harmless(make_body, tmp_path):
    with make_body() as body:
        recorder = Recorder(body, tmp_path, "")
        recorder.close()
        recorder.close()


def test_a_closed_recorder_refuses_more(make_body, tmp_path):
    with make_body() as body:
        recorder = Recorder(body, tmp_path, "")
        recorder.close()
        with pytest.raises(RecordingError, match="is closed"):
            recorder.add_truth(0.0, 0.0, 0.0, 0.0)


def test_an_interrupted_run_is_a_finished_recording(make_body, tmp_path):
    def interrupt() -> None:
        with make_body() as body, Recorder(body, tmp_path, "") as recorder:
            while body.clock.sleep_until(np.inf):
                recorder.flush()
                if body.clock.now() > 1.5:
                    raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupt()
    assert (tmp_path / "metadata.yaml").exists()
    assert open_log(tmp_path).span[1] == pytest.approx(1.52)


def test_the_truth_is_a_topic_of_its_own(make_body, tmp_path):
    with make_body() as body, Recorder(body, tmp_path, "") as recorder:
        while body.clock.sleep_until(np.inf):
            recorder.add_truth(body.clock.now(), 1.0, 2.0, 3.0)
            recorder.flush()
    assert len(open_log(tmp_path).truth()) == 150
    assert "truth" not in Replay(tmp_path).build().queues


def test_readings_that_the_recorder_missed_are_counted(make_body, tmp_path, caplog):
    events = [Event(0.001 * k, "imu", Imu(0.001 * k, 0.0)) for k in range(5000)]
    with make_body(events) as body, Recorder(body, tmp_path, ""):
        while body.clock.sleep_until(np.inf):
            pass
    assert "904 readings were not recorded" in caplog.text


KILLED = """
import sys, time
from pathlib import Path
from hardware.recorder import Recorder
from hardware.replay import Replay

with Replay(Path(sys.argv[1])).build() as body:
    recorder = Recorder(body, Path(sys.argv[2]), "<robot/>")
    while body.clock.sleep_until(1e9):
        recorder.flush()
        if body.clock.now() > 7.65:
            print(body.clock.now(), flush=True)
            time.sleep(60)
"""


def coreslam_rows(count):
    return "\n".join(" ".join(map(str, [100_000 * k, 0, 10 * k, 11 * k, *[0] * 20, *[1000 + k] * 682])) for k in range(count)) + "\n"


def test_kill_9_loses_at_most_the_last_second(tmp_path, caplog):
    log, run = tmp_path / "x.dat", tmp_path / "run"
    log.write_text(coreslam_rows(100))
    command = [sys.executable, "-c", KILLED, str(log), str(run)]
    with subprocess.Popen(command, cwd=Path(__file__).parents[2], stdout=subprocess.PIPE, text=True) as process:
        last = float(process.stdout.readline())
        process.send_signal(signal.SIGKILL)
    found = list(open_log(run).events())
    assert last - 1.0 <= found[-1].arrival <= last
    expected = [event for event in open_log(log).events() if event.arrival <= found[-1].arrival]
    assert [(event.channel, event.message.stamp) for event in found] == [(event.channel, event.message.stamp) for event in expected]
    assert "was not finished" in caplog.text


def test_an_unfinished_recording_is_newer_than_a_finished_one_beside_it(make_body, tmp_path):
    record(make_body(), tmp_path)
    with make_body() as body:
        recorder = Recorder(body, tmp_path, "second")
        while body.clock.sleep_until(2.0):
            recorder.flush()
            if body.clock.now() >= 2.0:
                break
        recorder._writer.abandon()
    assert open_log(tmp_path).description() == "second"


@pytest.fixture
def full_disk():
    """No file may grow beyond 60 kB."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, limits[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def test_a_full_disk_is_one_line_and_what_was_written_stays_readable(make_body, tmp_path, full_disk):
    with pytest.raises(RecordingError, match="cannot be written on: File too large; what was written stays readable"):
        record(make_body(), tmp_path)
    events = list(open_log(tmp_path).events())
    assert 0.9 <= events[-1].arrival < 3.0


def test_a_disk_that_is_full_from_the_start_is_one_line(make_body, tmp_path):
    (tmp_path / "recording.mcap.part").symlink_to("/dev/full")
    with pytest.raises(RecordingError, match="No space left on device"):
        record(make_body(), tmp_path)


def test_a_folder_that_cannot_be_made_is_one_line_and_nothing_subscribes(make_body, tmp_path):
    (tmp_path / "file").touch()
    with make_body() as body:
        with pytest.raises(RecordingError, match=r"cannot be written: .*; name another folder"):
            Recorder(body, tmp_path / "file", "")
        assert not any(queue._subscribers[1:] for queue in body.queues.values())


def test_a_true_pose_is_what_was_given(make_body, tmp_path):
    with make_body() as body, Recorder(body, tmp_path, "") as recorder:
        while body.clock.sleep_until(np.inf):
            recorder.flush()
        recorder.add_truth(2.5, 0.1, 0.2, -3.0)
    assert SE2.from_array(open_log(tmp_path).truth().poses[0]) == SE2(0.1, 0.2, -3.0)
