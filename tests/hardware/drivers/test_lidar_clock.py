import numpy as np
import pytest

from hardware.drivers.lidar_clock import LidarClock, best_offset
from hardware.protocols.scip_sweep import WRAP_MS


def test_stamps_go_on_when_the_counter_wraps():
    clock = LidarClock(WRAP_MS - 100, 50.0)
    assert clock.host_time(WRAP_MS - 100) == pytest.approx(50.0)
    assert clock.host_time(100) == pytest.approx(50.2)
    assert clock.host_time(WRAP_MS - 50) == pytest.approx(50.05)


def test_a_clock_that_drifts_is_followed():
    rng = np.random.default_rng(0)
    clock, worst = LidarClock(0, 0.0), 0.0
    for scan in range(6000):
        measured = 0.1 * scan
        stamp_ms = int(1e3 * measured * (1.0 + 1e-4))
        stamp = clock.host_time(stamp_ms % WRAP_MS)
        clock.observe(stamp, measured + 0.101 + rng.exponential(0.002))
        worst = max(worst, abs(stamp - measured))
    assert worst < 0.003


def test_arrivals_that_are_late_for_a_while_move_nothing():
    clock = LidarClock(0, 0.0)
    for scan in range(500):
        measured = 0.1 * scan
        stamp = clock.host_time(round(1e3 * measured))
        clock.observe(stamp, measured + 0.101 + (0.03 if 100 < scan < 300 else 0.0))
    assert clock.host_time(50000) == pytest.approx(50.0, abs=1e-3)


def test_the_offset_is_that_of_the_quick_exchanges():
    rng = np.random.default_rng(1)
    samples = []
    for k in range(16):
        sent = 100.0 + 0.01 * k
        late = rng.exponential(0.004)
        told = sent + 0.001 + late
        samples.append((sent, int((told - 90.0) * 1e3), told + 0.001))
    counter, host = best_offset(samples)
    assert host - counter * 1e-3 == pytest.approx(90.0, abs=1e-3)
