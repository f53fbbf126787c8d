"""One factory for each registered backend, and the drive that all of them make (or made, when they were recorded)."""

import functools
import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import pytest

from hardware.faults import Faults
from hardware.hal import Command, Recorded, Resettable, Robot
from hardware.recorder import Recorder
from hardware.registry import BACKENDS, backend_class
from hardware.urdf import urdf
from slam.messages import SensorFrame, Twist

FORWARD, LEFT = Twist(0.1, 0.0), Twist(0.0, 0.5)
NOWHERE = ("tcp:127.0.0.1:9", "tcp:127.0.0.1:9")
DURATION = 3.6
"""Two seconds forward, one and a half to the left."""


IN_WALL_CLOCK_TIME = ("ev3",)
ROBOTS = [
    *(pytest.param(name, marks=pytest.mark.wall_clock if name in IN_WALL_CLOCK_TIME else ()) for name in sorted(BACKENDS)),
    "twin without faults",
    "recording without faults",
]


@dataclass(frozen=True)
class Case:
    """How to get a robot of one backend, and one whose `open()` must fail."""

    make: Callable[[], Robot]
    fail: Callable[[], None]


@pytest.fixture(scope="session")
def live() -> Callable[[Robot], bool]:
    """Whether a body's time is that of the world: nobody lands on a time exactly."""
    return lambda robot: not isinstance(robot, Resettable | Recorded)


def scripted(t: float) -> Twist:
    return FORWARD if t < 2.0 else LEFT


class Run(NamedTuple):
    """What a robot did."""

    robot: Robot
    """Closed."""
    frames: list[SensorFrame]
    commands: list[Command]
    """What it was really told and when: on a busy machine the script's times are not kept."""

    def told(self, until: float) -> tuple[float, float]:
        """Integrals of v [m] and omega [rad] of the commands up to a time [s]."""
        ends = [*(command.stamp for command in self.commands[1:]), math.inf]
        parts = [(max(min(end, until) - command.stamp, 0.0), command.twist) for command, end in zip(self.commands, ends, strict=True)]
        return sum(span * twist.v for span, twist in parts), sum(span * twist.omega for span, twist in parts)

    @property
    def turn(self) -> float:
        """When it was told to turn [s]."""
        return next(command.stamp for command in self.commands if command.twist.omega > 0.1)


def drive_script(robot: Robot, each: Callable[[], None] = lambda: None) -> Run:
    """The whole script, on an open robot."""
    frames, commands, start = [], [], robot.clock.now()
    while robot.clock.now() - start < DURATION and robot.clock.sleep_until(robot.clock.now() + 0.05):
        frames.append(robot.read())
        now = robot.clock.now()
        commands.append(Command(now, robot.drive(scripted(now - start))))
        each()
    return Run(robot, frames, commands)


def _real(ev3: type, brick: str, lidar: str) -> Robot:
    return ev3(ev3=brick, lidar=lidar).build()


@pytest.fixture(scope="session")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recording")
    with backend_class("sim")().build() as robot, Recorder(robot, folder, urdf(robot.spec)) as recorder:
        drive_script(robot, recorder.flush)
    return folder


@pytest.fixture(scope="session")
def cases(recording: Path, emulate: Callable[..., tuple[str, ...]]) -> dict[str, Case]:
    sim, kinematic, replay, ev3 = (backend_class(name) for name in ("sim", "kinematic", "replay", "ev3"))
    emulated = functools.cache(lambda: itertools.cycle([emulate(), emulate("--seed", "1")]))  # two of them live side by side
    nowhere = recording / "no_such_file"
    return {
        "ev3": Case(lambda: _real(ev3, *next(emulated())), lambda: _real(ev3, *NOWHERE).open()),
        "sim": Case(lambda: sim().build(), lambda: sim(world="no_such_world").build().open()),
        "kinematic": Case(lambda: kinematic().build(), lambda: kinematic(world="no_such_world").build().open()),
        "replay": Case(lambda: replay(path=recording).build(), lambda: replay(path=nowhere).build().open()),
        "twin without faults": Case(lambda: Faults(kinematic()).build(), lambda: Faults(kinematic(world="no_such_world")).build().open()),
        "recording without faults": Case(
            lambda: Faults(replay(path=recording)).build(), lambda: Faults(replay(path=nowhere)).build().open()
        ),
    }


@pytest.fixture(params=ROBOTS)
def case(request: pytest.FixtureRequest, cases: dict[str, Case]) -> Case:
    if request.param not in cases:
        pytest.fail(f"the backend '{request.param}' has no factory in tests/conformance/conftest.py")
    return cases[request.param]


@pytest.fixture(params=ROBOTS, scope="session")
def run(request: pytest.FixtureRequest, cases: dict[str, Case]) -> Run:
    """A robot's whole script."""
    with cases[request.param].make() as robot:
        return drive_script(robot)


@pytest.fixture
def driven(case: Case) -> Robot:
    """A robot that obeys; recordings do not."""
    robot = case.make()
    if isinstance(robot, Recorded):
        pytest.skip("a recording's motion is already decided")
    return robot
