from collections.abc import Callable
from pathlib import Path

import pytest

from hardware.errors import HardwareError, NotOpenError
from hardware.hal import Recorded, Robot
from sim.bullet import pybullet
from slam.messages import Twist
from worlds.errors import WorldError


def held() -> tuple[int, int]:
    """Open files and connected physics clients of this process."""
    clients = sum(bool(pybullet.isConnected(client)) for client in range(64))
    return len(list(Path("/proc/self/fd").iterdir())), clients


USES: dict[str, Callable[[Robot], object]] = {
    "read": lambda robot: robot.read(),
    "drive": lambda robot: robot.drive(Twist()),
    "sleep": lambda robot: robot.clock.sleep_until(1.0),
}


@pytest.mark.parametrize("use", USES)
def test_use_before_open_is_an_error(case, use):
    with pytest.raises(NotOpenError):
        USES[use](case.make())


@pytest.mark.parametrize("use", USES)
def test_use_after_close_is_an_error(case, use):
    robot = case.make()
    with robot:
        pass
    with pytest.raises(NotOpenError):
        USES[use](robot)


def test_close_is_idempotent(case):
    robot = case.make()
    robot.close()
    robot.open()
    robot.close()
    robot.close()


def test_a_closed_robot_opens_again_at_the_same_time(case, live):
    robot = case.make()
    with robot:
        start = robot.clock.now()
        robot.clock.sleep_until(start + 0.2)
    with robot:
        assert robot.clock.now() >= start + 0.2 if live(robot) else robot.clock.now() == start
        start = robot.clock.now()
        assert robot.clock.sleep_until(start + 0.2)


def test_open_and_close_hold_nothing_afterwards(case):
    with case.make():
        pass
    before = held()
    with case.make() as robot:
        robot.clock.sleep_until(robot.clock.now() + 0.2)
    assert held() == before


def test_an_error_inside_the_block_lets_go_of_everything(case):
    before = held()
    with pytest.raises(ZeroDivisionError), case.make():
        raise ZeroDivisionError
    assert held() == before


def test_a_failed_open_holds_nothing(case):
    before = held()
    with pytest.raises((HardwareError, WorldError)) as caught:
        case.fail()
    assert held() == before
    assert "\n" not in str(caught.value)


def test_two_robots_live_side_by_side(case, live):
    with case.make() as one, case.make() as other:
        one.clock.sleep_until(one.clock.now() + 0.5)
        assert one.health().link
        assert other.health().link
        assert live(one) or other.clock.now() < one.clock.now()


def test_spec_and_queues_are_readable_before_open(case):
    robot = case.make()
    assert robot.spec.available
    assert robot.spec.available <= set(robot.queues)
    assert "commands" in robot.queues


def test_data_end_once_and_for_all_or_never(case, live):
    with case.make() as robot:
        steps, enough = 0, 50 if live(robot) else 5000
        while steps < enough and robot.clock.sleep_until(robot.clock.now() + 0.01):
            steps += 1
        if isinstance(robot, Recorded):
            assert robot.clock.now() == pytest.approx(robot.span[1], abs=1e-6)
            assert not robot.clock.sleep_until(robot.clock.now() + 1.0)
            robot.read()
            assert robot.read().scans == ()
        else:
            assert steps == enough


def test_the_robot_reports_that_its_devices_answer(case):
    with case.make() as robot:
        robot.clock.sleep_until(robot.clock.now() + 0.2)
        health = robot.health()
    assert health.link
    assert not health.stalled
    assert not health.emergency_stop
    assert health.dropped == 0
