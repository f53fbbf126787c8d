import numpy as np

from hardware.drivers.device_clock import DeviceClock


def test_it_goes_by_the_quickest_exchange():
    clock, rng = DeviceClock(), np.random.default_rng(2)
    assert not clock.known
    for k in range(40):
        sent = 10.0 + k
        there, back = 0.001 + rng.exponential(0.01, 2)
        clock.observe(sent, sent + there + 500.0, sent + there + back)
    assert clock.known
    assert abs(clock.host_time(550.0) - 50.0) < 0.002


def test_it_follows_a_clock_that_drifts():
    clock = DeviceClock(kept=10)
    for k in range(1000):
        sent = float(k)
        clock.observe(sent, (sent + 0.001) * (1.0 + 1e-4), sent + 0.002)
    assert abs(clock.host_time(999.0 * (1.0 + 1e-4)) - 999.0) < 0.002
