import math

import numpy as np
import pytest

from slam.messages import Twist
from slam.navigation.navigator import Navigation, Progress
from slam.se2 import SE2


class Driver:
    """Drives a navigator to a place, and keeps what it commanded."""

    def __init__(self, goal, heading=None, within=0.15, settings=None) -> None:
        self.navigator = (settings or Navigation()).build()
        self.arguments = goal, heading, within
        self.twists: list[Twist] = []
        self.outcome = None

    def __call__(self, frame, estimate, snapshot):
        navigator = self.navigator
        navigator.see(frame, estimate, snapshot)
        if navigator.goal is None:
            navigator.go(*self.arguments)
        self.outcome = navigator.progress if navigator.progress in (Progress.ARRIVED, Progress.FAILED) else None
        self.twists.append(navigator.drive())
        return self.twists[-1]


def test_it_drives_through_the_door_and_faces_what_it_should(rooms, cell_world) -> None:
    world, driver = cell_world(rooms, SE2(1.0, 1.0), known=True), Driver((6.0, 2.0), math.pi / 2.0)
    world.run(driver, 90.0)
    assert driver.outcome is Progress.ARRIVED
    assert np.hypot(world.pose.x - 6.0, world.pose.y - 2.0) < 0.1
    assert world.pose.yaw == pytest.approx(math.pi / 2.0, abs=0.2)


def test_it_does_not_turn_to_what_it_sees_from_where_it_comes(rooms, cell_world) -> None:
    world, driver = cell_world(rooms, SE2(1.0, 1.0), known=True), Driver((2.5, 1.0), 1.0, 1.2)
    world.run(driver, 30.0)
    assert driver.outcome is Progress.ARRIVED
    assert abs(world.pose.yaw) < 0.1


def test_to_turn_round_in_a_narrow_place_is_no_standstill(of_picture, cell_world) -> None:
    truth = of_picture("##########\n#........#\n##########\n", scale=10)  # a corridor of 0.5 m
    world, driver = cell_world(truth, SE2(2.0, 0.75), known=True), Driver((4.0, 0.75))
    world.pose = SE2(2.0, 0.75, math.pi)
    world.run(driver, 60.0)
    assert driver.outcome is Progress.ARRIVED
    assert min(twist.v for twist in driver.twists) >= 0.0, "it has backed up"


def test_a_way_that_is_blocked_for_good_fails(rooms, cell_world) -> None:
    world, driver = cell_world(rooms, SE2(1.0, 1.0), known=True), Driver((6.0, 2.0))
    world.block(3.6, 0.2, 4.2, 3.1)
    world.run(driver, 120.0)
    assert driver.outcome is Progress.FAILED
    assert world.time < 90.0
