from pathlib import Path

import pytest

from scripts.bench.twin import ALL_SENSORS, WITHOUT, digests, fresh_digests, twin, unmoved
from sim.robot import Sim

DURATION = 1.5


@pytest.fixture(scope="module")
def first():
    """SHA-256 of all sensors' readings on a drive, of one that follows other noise, and of one that follows a reset."""
    with twin(Sim, ALL_SENSORS, 7) as robot:
        found = [digests(robot, DURATION)]
        for seed in (8, 7):
            robot.reset(seed)
            found.append(digests(robot, DURATION))
    return found


def test_a_fresh_process_gives_the_same_bits(first):
    assert fresh_digests(7, DURATION) == first[0]


def test_a_reset_gives_the_same_bits(first):
    assert first[2] == first[0]


def test_another_seed_gives_other_readings_of_every_sensor(first):
    assert all(first[1][sensor] != first[0][sensor] for sensor in first[0])


@pytest.mark.parametrize("sensor", WITHOUT)
def test_without_one_sensor_the_others_read_the_same_bits(sensor):
    assert unmoved(sensor, 7, DURATION)


def test_resets_leave_no_memory_behind():
    def resident() -> float:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return pages * 4096 / 1e6

    with Sim().build() as robot:
        for seed in range(30):
            robot.reset(seed)
        before = resident()
        for seed in range(60):
            robot.reset(seed)
        assert resident() - before <= 3.0
