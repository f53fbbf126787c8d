"""The bench over the wire, in its parts: short, and able to see what is wrong."""

import random
import time

import numpy as np
import pytest

from scripts.bench import GROUPS
from scripts.bench.wire import stamps, stops
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
