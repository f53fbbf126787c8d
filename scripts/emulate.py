"""The verb `twin emulate`: the devices of the real robot, with the twin behind them, in real time."""

from __future__ import annotations

import math
import random
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TextIO

from tyro.conf import arg

from hardware.drivers import ev3dev_server
from hardware.drivers.brick_driver import OUTPUTS, Ev3Ports
from hardware.drivers.transport import host_and_port
from hardware.emulators.channels import Channel, PtyChannel, TcpChannel
from hardware.emulators.d435 import D435
from hardware.emulators.ev3_brick import BeaconSender, Ev3Brick
from hardware.emulators.ev3dev_brick import Ev3devBrick
from hardware.emulators.port import Port
from hardware.emulators.urg_lidar import UrgLidar
from hardware.protocols import ev3_direct
from hardware.protocols.ev3_direct import Beacon
from hardware.robot_file import RobotFile, read_robot_file
from scripts.errors import UsageError
from scripts.options import OptionalFile, parse
from scripts.runs.interruption import interruptible
from slam.messages import Trajectory

if TYPE_CHECKING:
    from sim.twin import Twin
    from sim.wire import WiredTwin, Wiring

HELP = "serve the devices of the real robot on ports, with the twin behind them"
SERIAL = "001653000000"
"""Of the emulated brick."""
DELAYS: dict[str, Callable[[], float]] = {
    "none": lambda: 0.0,
    "usb": lambda: random.lognormvariate(-4.78, 0.3),
    "bluetooth": lambda: min(random.lognormvariate(-2.80, 0.45), 0.122),
}
"""Time from request to reply [s]: medians 8.4 and 61 ms, as measured on real bricks."""
PAUSE = 0.1
"""Between two looks whether to end [s]."""


@dataclass(frozen=True)
class EmulateOptions:
    """Serve brick, lidar and camera of the real robot on ports or pseudo-terminals, with the twin behind them, in real time.

    $ twin emulate --world aruco_room                                 in one terminal, and in another
    $ twin run --robot ev3 --ev3 tcp:127.0.0.1 --lidar tcp:127.0.0.1  the drivers of the real robot

    Ctrl-C ends it.
    """

    world: Annotated[str, arg(metavar="NAME")] = "aruco_room"
    """World around the robot: NAME, NAME:option=value,... or a .toml file."""
    robot: Literal["sim", "kinematic"] = "sim"
    """Which twin is behind the devices."""
    realism: Annotated[str, arg(metavar="NAME")] = "datasheet"
    """How imperfect it is, as in `twin run`."""
    seed: Annotated[int, arg(metavar="N")] = 0
    """Of all its noise."""
    ev3: Annotated[str, arg(metavar="WHERE")] = "tcp:127.0.0.1:5555"
    """Where the brick is served: tcp:HOST:PORT (port 0: any that is free), the path that a pseudo-terminal shall have, or
    ev3dev:HOST:PORT for a brick with ev3dev, whose own server runs on files as its kernel has them."""
    lidar: Annotated[str, arg(metavar="WHERE")] = "tcp:127.0.0.1:10940"
    """Where the lidar is served: tcp:HOST:PORT, or the path that a pseudo-terminal shall have."""
    camera: Annotated[str, arg(metavar="WHERE")] = "none"
    """Where the camera is served: tcp:HOST:PORT, or `none`, for its images are work: a driver fills a device of the vendor's library
    with them."""
    painter: Literal["raster", "embree"] = "raster"
    """What draws the camera's images, as in `twin run`."""
    delay: Literal["none", "usb", "bluetooth"] = "usb"
    """How long the stock firmware takes to answer; a brick with ev3dev takes the time that its server takes."""
    spec: OptionalFile = None
    """Wheels, mounts and ports of the robot that the devices are of, robot.toml, as in `twin run`."""
    truth: OptionalFile = None
    """File for the true way, a TUM trajectory on the clock of this computer, written as it goes; `twin run --truth` scores with it."""
    duration: Annotated[float | None, arg(metavar="S", help_behavior_hint="(default: until Ctrl-C)")] = None
    """Time to serve [s]."""


def main(argv: list[str]) -> int:
    """Serve; returns the exit code."""
    options = parse(EmulateOptions, argv, "emulate")
    if options.duration is not None and not options.duration > 0.0:
        raise UsageError(f"--duration {options.duration:g}: give a positive number of seconds")
    serve(options)
    return 0


def serve(options: EmulateOptions) -> None:
    """Serve until the time is over or Ctrl-C.

    Raises:
        EmulatorError, WorldError, SimError: it cannot begin.
    """
    from hardware.registry import backend_class
    from sim.twin import Twin
    from sim.wire import WiredTwin, on_the_wire

    robot = RobotFile() if options.spec is None else read_robot_file(options.spec)
    eyes = {"camera": options.painter} if options.camera != "none" else {}
    realism = on_the_wire(options.realism)
    body = backend_class(options.robot)(world=options.world, seed=options.seed, realism=realism, spec=robot.spec, **eyes)
    assert isinstance(body, Twin), f"{options.robot} is no twin"
    twin = WiredTwin(body, time.monotonic, wiring_of(robot.ports))
    with ExitStack() as stack, interruptible() as stopped:
        stack.enter_context(twin)
        brick = _brick(options, twin)
        lidar = Port(UrgLidar(twin.next_turn, twin.now), channel_at(options.lidar))
        camera = _camera(options.camera, twin, body)
        for port in (brick, lidar, *camera):
            stack.enter_context(port)
        stack.enter_context(_beacon(brick.address))
        seen = "".join(f"camera at {port.address}, " for port in camera)
        print(f"brick at {brick.address}, lidar at {lidar.address}, {seen}{options.world} around them; Ctrl-C ends it", flush=True)
        truth = stack.enter_context(_truth_file(options.truth))
        end = time.monotonic() + (options.duration or float("inf"))
        while not stopped() and time.monotonic() < end:
            time.sleep(PAUSE)
            if truth is not None:
                truth.write(_lines(twin.new_truth()))
                truth.flush()


def wiring_of(ports: Ev3Ports) -> Wiring:
    """The twin's side of what is plugged in where."""
    from sim.wire import Wiring

    left, right = (OUTPUTS.index(output) for output in (ports.left, ports.right))
    return Wiring(left, right, ports.gyro - 1 if ports.gyro else None, ports.reversed)


def _brick(options: EmulateOptions, twin: WiredTwin) -> Port | Ev3devBrick:
    if options.ev3.startswith("ev3dev:"):
        return Ev3devBrick(twin, *_place(options.ev3.removeprefix("ev3dev:"), ev3dev_server.PORT))
    return Port(Ev3Brick(twin, wifi=options.ev3.startswith("tcp:"), delay=DELAYS[options.delay]), channel_at(options.ev3))


def _camera(address: str, twin: WiredTwin, body: Twin) -> list[Port]:
    """The camera's port, if one is asked for."""
    if address == "none":
        return []
    if not address.startswith("tcp:"):
        raise UsageError(f"--camera {address}: write tcp:HOST:PORT or none")
    return [Port(D435(twin.next_image, twin.now, body.spec.require_camera()), channel_at(address))]


def _truth_file(path: Path | None) -> AbstractContextManager[TextIO | None]:
    if path is None:
        return nullcontext()
    try:
        return path.open("w", encoding="ascii")
    except OSError as error:
        raise UsageError(f"--truth {path}: {error.strerror}") from error


def _lines(truth: Trajectory) -> str:
    """Whole lines of a TUM file."""
    rows = zip(truth.stamps.tolist(), truth.poses.tolist(), strict=True)
    return "".join(f"{t:.6f} {x:.6f} {y:.6f} 0 0 0 {math.sin(0.5 * yaw):.9f} {math.cos(0.5 * yaw):.9f}\n" for t, (x, y, yaw) in rows)


def channel_at(address: str) -> Channel:
    """The wire that an address names.

    Raises:
        UsageError: it names none.
    """
    if not address:
        raise UsageError("an address is missing: write tcp:HOST:PORT, or a path for a pseudo-terminal")
    if not address.startswith("tcp:"):
        return PtyChannel(Path(address))
    return TcpChannel(*_place(address.removeprefix("tcp:"), 0))


def _place(place: str, port: int) -> tuple[str, int]:
    """Host and port to serve on; port 0 is any that is free."""
    return (place.removesuffix(":0") or "127.0.0.1", 0) if place.endswith(":0") else host_and_port(place, port)


def _beacon(address: str) -> ExitStack:
    """The brick's beacon, where it is served over TCP on a port of four digits: other people's clients stumble over more."""
    stack = ExitStack()
    if not address.startswith("tcp:"):
        return stack
    host, port = host_and_port(address.removeprefix("tcp:"), ev3_direct.TCP_PORT)
    if port < 10_000:
        sender = BeaconSender(Beacon(SERIAL, port), host)
        sender.open()
        stack.callback(sender.close)
    return stack
