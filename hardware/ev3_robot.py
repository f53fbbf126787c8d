"""The real robot: an EV3, a lidar and a camera, composed into a `Robot`."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from hardware.bricks import make_brick
from hardware.drivers.brick_driver import Ev3Ports
from hardware.drivers.errors import DeviceError
from hardware.drivers.hokuyo import HokuyoDriver
from hardware.drivers.realsense import Camera, RealSenseDriver, find_camera
from hardware.drivers.transport import host_and_port
from hardware.errors import SpecError
from hardware.hal import Health
from hardware.host_clock import HostClock
from hardware.openable import Openable
from hardware.queues import EventQueue, Subscription
from hardware.spec import RobotSpec
from slam.messages import Imu, LaserScan, RgbdImage, SensorFrame, Twist, WheelOdometry

SENSORS = ("odometry", "imu", "scans", "images")
IMAGES_KEPT = 8
"""Images that wait for a reader: one who is too slow gets the newest, half a second of them."""
HOLD_LIMIT = 1.0
"""A scan or an image is not held longer than this for odometry that does not come [s]."""
FRESH = 0.1
"""An encoder reading older than this is not the end of a frame: the brick is silent [s]."""
BLIND_TIME = 1.0
"""Without a scan for so long the robot does not drive [s]."""
STALL_PATIENCE = 1.0
"""A wheel that is stalled for so long is not driven on until a twist of zero has been commanded [s]."""

Lasting = TypeVar("Lasting", LaserScan, RgbdImage)


@dataclass(frozen=True, slots=True)
class Ev3:
    """The real robot."""

    ev3: str = "usb"
    """Where the brick is: `usb`, `usb:SERIAL`, `tcp:HOST[:PORT]`, `wifi`, `wifi:SERIAL`, the path of a serial port, or with ev3dev on it
    `ev3dev:HOST[:PORT]`."""
    lidar: str = "/dev/ttyACM0"
    """Where the lidar is: the path of a serial port, or `tcp:HOST[:PORT]`; empty: there is none."""
    camera: str = "none"
    """Where the camera is: `usb`, `usb:SERIAL`, `tcp:HOST[:PORT]` for the one of `twin emulate`, or `none`."""
    ports: Ev3Ports = field(default_factory=Ev3Ports)
    """What is plugged into the brick where."""
    low_battery: float = 6.2
    """The robot does not drive when the battery has less [V]; the rechargeable pack warns at 7.1."""
    spec: RobotSpec = field(default_factory=RobotSpec)
    """Wheels, limits, sensors and their mounts."""

    def __post_init__(self) -> None:
        spec = self.spec
        if spec.drive is None:
            raise SpecError("the robot drives on wheels; give the spec a `drive`")
        imu = replace(spec.imu, period=spec.drive.period) if spec.imu is not None and self.ports.gyro else None  # both in one message
        camera = spec.camera if self.camera != "none" else None
        object.__setattr__(self, "spec", replace(spec, camera=camera, imu=imu, lidar=spec.lidar if self.lidar else None))

    def build(self) -> Ev3Robot:
        """Make the robot; nothing is opened yet."""
        return Ev3Robot(self)


class Ev3Robot(Openable):
    """Implements `Robot` of `hardware.hal`."""

    def __init__(self, parameters: Ev3) -> None:
        self._parameters = parameters
        spec = parameters.spec
        self._odometry, self._imu, self._scans = EventQueue[WheelOdometry](), EventQueue[Imu](), EventQueue[LaserScan]()
        self._queues: dict[str, EventQueue[Any]] = {
            "odometry": self._odometry,
            "imu": self._imu,
            "scans": self._scans,
            "commands": EventQueue[Any](),
            "images": EventQueue[Any](IMAGES_KEPT),
        }
        self._brick = make_brick(parameters.ev3, parameters.ports, spec, self._queues["commands"], (self._odometry, self._imu))
        self._orders = self._brick.orders
        self._lidar = HokuyoDriver(parameters.lidar, spec.lidar, self._scans) if spec.lidar is not None else None
        find = camera_finder(parameters.camera)
        self._camera = RealSenseDriver(parameters.camera, spec, self._queues["images"], find) if spec.camera is not None else None
        self._inbox: dict[str, Subscription[Any]] = {}
        self._held: list[LaserScan] = []
        self._developing: list[RgbdImage] = []
        self._covered = float("-inf")
        self._clock = HostClock()
        self._opened = 0.0
        self._stuck: float | None = None
        self._given_up = False
        self._framed = float("-inf")
        self._emergency = False

    @property
    def spec(self) -> RobotSpec:
        """What the robot is."""
        return self._parameters.spec

    @property
    def clock(self) -> HostClock:
        """The computer's monotonic clock."""
        return self._clock

    @property
    def queues(self) -> Mapping[str, EventQueue[Any]]:
        """`odometry`, `imu`, `scans`, `images`, `commands`."""
        return self._queues

    def open(self) -> None:
        """Take hold of brick, lidar and camera; an open robot stays as it is.

        Raises:
            DeviceError: one of them cannot be used; nothing is held.
        """
        if self._clock.running:
            return
        for queue in self._queues.values():
            queue.latest = None
        with ExitStack() as held:
            for sensor in self._eyes:
                sensor.open()
                held.callback(sensor.close)
            self._inbox = {name: self._queues[name].subscribe() for name in SENSORS}
            held.callback(self._unsubscribe)
            self._brick.open()
            held.pop_all()
        self._held, self._developing, self._covered, self._framed = [], [], float("-inf"), float("-inf")
        self._stuck, self._given_up, self._emergency = None, False, False
        self._opened = time.monotonic()
        self._clock.running = True

    def close(self) -> None:
        """Stop the wheels and let go. May be called twice."""
        self._clock.running = False
        self._brick.close()
        for sensor in self._eyes:
            sensor.close()
        self._unsubscribe()

    def read(self) -> SensorFrame:
        """Everything since the last read, oldest first; scans and images wait for the odometry of their end.

        Raises:
            NotOpenError: outside `open()` .. `close()`.
        """
        self._clock.require()
        images, scans, imu, odometry = (tuple(self._inbox[name].take()) for name in reversed(SENSORS))
        now = self._clock.now()
        self._covered = odometry[-1].stamp if odometry else self._covered
        scans, self._held = self._split([*self._held, *scans], now)
        images, self._developing = self._split([*self._developing, *images], now)
        # a frame ends on its last encoder reading, or the estimate would be of a time that nothing was measured at
        self._framed = max(self._framed, self._covered if now - self._covered < FRESH else now)
        return SensorFrame(self._framed, odometry, imu, scans, self.spec.available, images)

    def drive(self, twist: Twist) -> Twist:
        """Command a twist of `base`; returns what is really commanded after limits, zero while it is not safe to move.

        Raises:
            NotOpenError: outside `open()` .. `close()`.
        """
        self._clock.require()
        now = self._clock.now()
        return self._orders.give(Twist() if self._must_stand(twist, now) else twist, now)

    def stop_at_once(self) -> None:
        """Emergency stop: nothing moves the wheels again before the next `open()`."""
        self._emergency = True
        self._orders.halt()

    def health(self) -> Health:
        """The body's state now."""
        state = self._brick.state
        link = self._brick.link and all(sensor.link for sensor in self._eyes)
        dropped = sum(inbox.dropped for inbox in self._inbox.values())
        return Health(state.volts, state.stalled, link, dropped, self._emergency)

    @property
    def _eyes(self) -> list[HokuyoDriver | RealSenseDriver]:
        return [sensor for sensor in (self._lidar, self._camera) if sensor is not None]

    def _split(self, waiting: Sequence[Lasting], now: float) -> tuple[tuple[Lasting, ...], list[Lasting]]:
        """Readings that odometry covers or that have waited too long at `now` [s], and the rest."""
        ready = 0
        while ready < len(waiting) and (waiting[ready].end <= self._covered or now - waiting[ready].end > HOLD_LIMIT):
            ready += 1
        return tuple(waiting[:ready]), list(waiting[ready:])

    def _must_stand(self, twist: Twist, now: float) -> bool:
        state = self._brick.state
        self._watch_for_stall(twist, now, state.stalled)
        empty = state.volts is not None and state.volts < self._parameters.low_battery
        return self._emergency or self._given_up or empty or self._is_blind(now)

    def _watch_for_stall(self, twist: Twist, now: float, stalled: bool) -> None:
        """Give up on a wheel that is held, until the caller commands to stand."""
        if twist == Twist():
            self._given_up = False
        if not stalled or twist == Twist():
            self._stuck = None
        elif self._stuck is None:
            self._stuck = now
        self._given_up |= self._stuck is not None and now - self._stuck > STALL_PATIENCE

    def _is_blind(self, now: float) -> bool:
        if self._lidar is None:
            return False
        latest = self._scans.latest
        return now - (latest.end if latest is not None else self._opened) > BLIND_TIME

    def _unsubscribe(self) -> None:
        for name, inbox in self._inbox.items():
            self._queues[name].unsubscribe(inbox)
        self._inbox = {}


def camera_finder(address: str) -> Callable[[], Camera]:
    """What connects to the camera at an address.

    Raises:
        DeviceError: the address is none.
    """
    way, _, rest = address.partition(":")
    if way == "tcp":
        from hardware.emulators.d435_feeder import TCP_PORT, Feeder  # only who emulates needs it

        place = host_and_port(rest, TCP_PORT)
        return lambda: Feeder(*place)
    if way not in ("usb", "none"):
        raise DeviceError("camera", f"no address '{address}'", "write usb, usb:SERIAL, tcp:HOST[:PORT] or none")
    return lambda: find_camera(rest)
