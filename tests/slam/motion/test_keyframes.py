import math

import pytest

from slam.motion.keyframes import KeyframeGate
from slam.se2 import SE2

GATE = KeyframeGate(distance=0.1, yaw=0.2)
HERE = SE2(3.0, -2.0, math.pi - 0.1)


def test_the_first_scan_passes() -> None:
    assert GATE.passes(None, HERE)


def test_a_robot_that_stands_still_adds_nothing() -> None:
    assert not GATE.passes(HERE, HERE)


@pytest.mark.parametrize(
    ("step", "passes"), [((0.09, 0.0, 0.0), False), ((0.0, -0.11, 0.0), True), ((0.0, 0.0, 0.19), False), ((0.0, 0.0, -0.21), True)]
)
def test_enough_motion_of_either_kind_passes(step: tuple[float, float, float], passes: bool) -> None:
    assert GATE.passes(HERE, HERE @ SE2(*step)) == passes


def test_a_turn_through_the_half_turn_is_as_small_as_it_is() -> None:
    assert not GATE.passes(SE2(yaw=math.pi - 0.05), SE2(yaw=-math.pi + 0.05))
