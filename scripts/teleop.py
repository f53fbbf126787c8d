"""The verb `twin teleop`: drive by the keyboard; who lets go of it stops."""

from __future__ import annotations

import os
import select
import sys
import termios
import time
import tty
from collections.abc import Generator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from hardware.hal import Recorded, Resettable, Robot
from hardware.recorder import Recorder
from hardware.urdf import urdf
from scripts.errors import UsageError
from scripts.options import OptionalFile, parse
from scripts.runs.body import is_twin, make_robot
from scripts.runs.files import OutputError
from scripts.runs.interruption import interruptible
from scripts.runs.options import RunOptions
from slam.messages import Twist

HELP = "drive the robot by the keyboard; it stops when no key is held"
PERIOD = 0.05
"""Between two commands [s]."""
HOLD = 0.6
"""A key counts for so long: until the terminal repeats it [s]. Then the robot is told to stop."""
KEYS = {
    **{"w": (1, 0), "s": (-1, 0), "a": (0, 1), "d": (0, -1), "q": (1, 1), "e": (1, -1)},
    **{"A": (1, 0), "B": (-1, 0), "D": (0, 1), "C": (0, -1)},
}
"""Key, or last letter of an arrow's sequence -> forward and turn. Arrows are told from capital letters by the escape before them."""
LEAVE = "\x03\x04x"


@dataclass(frozen=True)
class TeleopOptions:
    """Drive by the keyboard: w or the arrow forward, s backwards, a and d turn, q and e drive a bow, space stops, x leaves.

    $ twin teleop --robot ev3                                  hold a key; let go of it and the robot stops
    $ twin teleop --robot ev3 --record drive                   and keep what it saw, for `twin run --robot replay:drive`
    """

    robot: Annotated[str, arg(metavar="BODY")] = "sim"
    """As in `twin run`; a twin runs in real time."""
    world: Annotated[str, arg(metavar="NAME")] = "aruco_room"
    """World of a twin."""
    ev3: Annotated[str, arg(metavar="WHERE")] = "usb"
    """Where the brick is, as in `twin run`."""
    lidar: Annotated[str, arg(metavar="WHERE")] = "/dev/ttyACM0"
    """Where the lidar is, as in `twin run`."""
    camera: Annotated[str, arg(metavar="NAME|WHERE")] = "none"
    """As in `twin run`."""
    spec: OptionalFile = None
    """The robot's file, robot.toml."""
    speed: Annotated[float, arg(metavar="M/S")] = 0.15
    """Forward [m/s]."""
    turn: Annotated[float, arg(metavar="RAD/S")] = 0.8
    """Yaw rate [rad/s]."""
    record: OptionalFile = None
    """Folder for a recording of the drive."""


def main(argv: list[str]) -> int:
    """Drive; returns the exit code."""
    options = parse(TeleopOptions, argv, "teleop")
    if not sys.stdin.isatty():
        raise UsageError("teleop listens to a keyboard; start it in a terminal")
    robot = make_robot(_run_options(options))
    if isinstance(robot, Recorded):
        raise UsageError(f"a recording cannot be driven: --robot {options.robot}")
    with ExitStack() as stack:
        stopped = stack.enter_context(interruptible())
        stack.enter_context(robot)
        recorder = None
        if options.record is not None:
            recorder = stack.enter_context(Recorder(robot, _made(options.record), urdf(robot.spec)))
        keys = stack.enter_context(keyboard())
        print("w s a d or arrows: drive, hold the key; space: stop; x: leave\r", flush=True)
        while not stopped() and keys.listen(PERIOD):
            _step(robot, keys.twist(options.speed, options.turn))
            if recorder is not None:
                recorder.flush()
    return 0


def _made(folder: Path) -> Path:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(folder, error) from error
    return folder


def _step(robot: Robot, twist: Twist) -> None:
    robot.clock.sleep_until(robot.clock.now() + PERIOD if isinstance(robot, Resettable) else robot.clock.now())
    robot.read()
    told, health = robot.drive(twist), robot.health()
    state = "" if health.link else "  LINK LOST"
    volts = "" if health.battery_volts is None else f"  {health.battery_volts:.1f} V"
    print(f"\r{told.v:+.2f} m/s {told.omega:+.2f} rad/s{volts}{'  STALLED' if health.stalled else ''}{state}   ", end="", flush=True)


class Keyboard:
    """The key that is held, as far as a terminal tells."""

    def __init__(self) -> None:
        self._wish = (0, 0)
        self._pressed = float("-inf")

    def listen(self, seconds: float) -> bool:
        """Listen for so long [s]; False when it is time to leave."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            if not select.select([sys.stdin], [], [], left)[0]:
                break
            typed = os.read(sys.stdin.fileno(), 64).decode("utf-8", "replace")
            if not typed or any(key in LEAVE for key in typed):
                return False
            self._take(typed)
        return True

    def twist(self, speed: float, turn: float) -> Twist:
        """What the held key asks for; silence is a stop."""
        if time.monotonic() - self._pressed > HOLD:
            return Twist()
        return Twist(speed * self._wish[0], turn * self._wish[1])

    def _take(self, typed: str) -> None:
        last = typed[-1]
        arrow = "\x1b[" in typed or "\x1bO" in typed
        known = last in KEYS and last.isupper() == arrow
        self._wish, self._pressed = KEYS[last] if known else (0, 0), time.monotonic()


@contextmanager
def keyboard() -> Generator[Keyboard, None, None]:
    """The terminal, key by key; as it was at the end."""
    before = termios.tcgetattr(sys.stdin)
    tty.setraw(sys.stdin, termios.TCSANOW)
    try:
        yield Keyboard()
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)
        print()


def _run_options(options: TeleopOptions) -> RunOptions:
    if is_twin(RunOptions(robot=options.robot)):
        return RunOptions(robot=options.robot, world=options.world, camera=options.camera, spec=options.spec)
    if options.robot == "ev3":
        return RunOptions(robot="ev3", ev3=options.ev3, lidar=options.lidar, camera=options.camera, spec=options.spec)
    return RunOptions(robot=options.robot, spec=options.spec)
