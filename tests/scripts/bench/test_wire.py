"""The bench over the wire, in its parts: short, and able to see what is wrong."""

import random
import time

import numpy as np
import pytest

from hardware.drivers.errors import DeviceError
from scripts import bench
from scripts.bench import GROUPS
from scripts.bench.row import Row
from scripts.bench.wire import faults, stamps, stops
from scripts.bench.wire.camera_trial import CameraTrial
from scripts.bench.wire.faults import KINDS, Ordeal
from scripts.bench.wire.lidar_trial import LidarTrial
from scripts.bench.wire.stage import ANYWHERE

pytestmark = pytest.mark.wall_clock


def test_stamps_are_near_the_truth():
    rows = stamps.rows(1.0)
    assert "wire" in GROUPS
    assert rows[0].value < 50.0


def test_a_scan_that_no_lidar_has_seen_is_told_of():
    with LidarTrial() as trial:
        trial._told.clear()
        end = time.monotonic() + 5.0
        while trial.wrong == 0 and time.monotonic() < end:
            trial._told.clear()
            trial.look()
            time.sleep(0.02)
        assert trial.wrong > 0


def test_a_client_that_is_killed_leaves_wheels_that_come_to_rest(tmp_path):
    assert 0.2 < stops.time_to_rest(ANYWHERE, tmp_path / "truth.tum") < 2.0


class Clockwork:
    """A trial whose readings always come."""

    name = "clockwork"
    wrong = 0

    class Line:
        silent = False
        disturbed = bytes
        pulled = 0

        def unplug(self):
            self.pulled += 1

        def replug(self):
            pass

    def __init__(self):
        self.port = self.Line()
        self.newest = 0.0
        self.answers = []

    def look(self):
        self.newest = time.monotonic()
        self.answers.append(self.port.disturbed(b"0123456789"))


def test_an_ordeal_knows_every_fault_and_leaves_the_wire_whole(monkeypatch):
    monkeypatch.setattr("scripts.bench.wire.faults.SHORTEST", 0.01)
    monkeypatch.setattr("scripts.bench.wire.faults.LONGEST", 0.05)
    monkeypatch.setattr("scripts.bench.wire.faults.REST", 0.01)
    trial = Clockwork()
    ordeal = Ordeal(trial, random.Random(3))
    for _ in range(30):
        ordeal.befall()
    assert ordeal.count == 30
    assert trial.port.pulled > 0
    assert min(len(answer) for answer in trial.answers) < 10 < max(len(answer) for answer in trial.answers)
    assert trial.answers[-1] == b"0123456789"
    assert not trial.port.silent
    assert set(ordeal.worst) == set(KINDS)
    assert np.all(np.array(list(ordeal.worst.values())) < 5.0)


def test_images_that_no_camera_has_taken_are_told_of():
    pytest.importorskip("libusb_package", reason="the vendor's library is not installed")
    with CameraTrial() as trial:
        end = time.monotonic() + 10.0
        while trial.newest < 0.0 and time.monotonic() < end:
            trial.look()
            time.sleep(0.02)
        assert trial.newest > 0.0
        assert trial.wrong == 0
        while trial.wrong == 0 and time.monotonic() < end:
            trial._told.clear()
            trial.look()
            time.sleep(0.02)
        assert trial.wrong > 0


def test_a_driver_that_does_not_open_has_a_row_that_says_why():
    class Missing(Clockwork):
        def __enter__(self):
            raise DeviceError("camera", "the package pyrealsense2 is missing", "pip install it")

        def __exit__(self, *_):
            pass

    [row] = faults.run_each([Missing()], 1.0)
    assert "not measured, camera: the package pyrealsense2 is missing" in row.name


def test_a_bench_that_is_broken_off_keeps_the_rows_that_are_known(monkeypatch, tmp_path, capsys):
    def broken_off(smoke):
        del smoke
        yield Row("wire", "known before", 1.0, "s")
        raise KeyboardInterrupt

    monkeypatch.setattr(stops, "run", broken_off)
    with pytest.raises(KeyboardInterrupt):
        bench.main(["wire", "--smoke", "--json", str(tmp_path / "rows.json")])
    assert "known before" in capsys.readouterr().out
    assert "known before" in (tmp_path / "rows.json").read_text()


def test_a_part_is_chosen_alone(monkeypatch, capsys):
    monkeypatch.setattr(stamps, "run", lambda smoke: [Row("wire", f"stamps, smoke {smoke}", 1.0, "ms")])
    assert bench.main(["wire.stamps", "--smoke"]) == 0
    assert "stamps, smoke True" in capsys.readouterr().out
