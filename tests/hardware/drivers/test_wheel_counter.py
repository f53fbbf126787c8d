import math

import pytest

from hardware.drivers.wheel_counter import BrickState, WheelCounter
from hardware.queues import EventQueue
from hardware.spec import DriveSpec

STILL = (0.0, 0.0)


@pytest.fixture
def counter():
    return WheelCounter(DriveSpec(), 1, BrickState(), EventQueue(), 0.0)


def angles(counter):
    return [math.degrees(angle) for angle in counter._state.odometry.wheel_angles]


@pytest.mark.parametrize("later", [0.02, 1e-4, 0.0])
def test_no_count_is_lost_however_near_the_stamps_are(counter, later):
    counter.report(1.0, (0, 0), STILL)
    counter.report(1.0 + later, (17, -16), STILL)
    assert angles(counter) == pytest.approx([17.0, -16.0])


def test_a_brick_that_counts_anew_is_no_motion(counter):
    counter.report(1.0, (9000, 9000), STILL)
    counter.report(1.02, (3, 3), STILL)
    counter.report(1.04, (5, 5), STILL)
    assert angles(counter) == pytest.approx([2.0, 2.0])
