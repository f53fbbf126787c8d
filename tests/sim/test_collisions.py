"""How often a twin says that it has run into something."""

import pytest

from sim.ground_truth import ground_truth
from sim.kinematic import Kinematic
from sim.robot import Sim
from slam.messages import Twist


def drive(twin, twist: Twist, until: float) -> int:
    with twin.build() as robot:
        while robot.clock.now() < until:
            robot.drive(twist)
            robot.clock.sleep_until(robot.clock.now() + 0.1)
        return ground_truth(robot).collisions


@pytest.mark.parametrize("twin", [Sim, Kinematic])
def test_a_robot_that_stands_touches_nothing(twin) -> None:
    assert drive(twin(world="aruco_room", realism="ideal"), Twist(), 0.5) == 0


@pytest.mark.parametrize("twin", [Sim, Kinematic])
def test_a_robot_that_drives_into_a_wall_touches_it(twin) -> None:
    assert drive(twin(world="maze", realism="ideal"), Twist(-0.3, 0.0), 3.0) >= 1
