"""A recording as a robot: same clock, same queues, same frames; it cannot be driven."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar, cast

from hardware.errors import NotOpenError
from hardware.hal import Command, Health
from hardware.logs.log import Log
from hardware.logs.registry import open_log
from hardware.logs.spec_file import read_spec
from hardware.openable import Openable
from hardware.queues import EventQueue, Subscription
from hardware.replay_clock import ReplayClock
from hardware.spec import RobotSpec
from slam.messages import Imu, LaserScan, RgbdImage, SensorFrame, Twist, WheelOdometry

SENSORS = ("odometry", "imu", "scans", "images")
CHANNELS = (*SENSORS, "commands")
IMAGES_KEPT = 32
"""Images that wait for a reader who does not come: they are large."""
HOLD_LIMIT = 1.0
"""A scan or an image is not held longer than this for odometry that does not come [s]."""
Lasting = TypeVar("Lasting", LaserScan, RgbdImage)


@dataclass(frozen=True)
class Replay:
    """A recording: a run folder, a rosbag2 of ours, a CARMEN or a CoreSLAM log."""

    path: Path
    """The file or folder."""
    spec: Path | None = None
    """A robot's specification (TOML) that replaces the recording's own."""

    def build(self) -> ReplayRobot:
        """Read what the recording says of its robot.

        Raises:
            RecordingError: the recording cannot be used.
            SpecError: the specification cannot be used.
        """
        path = Path(self.path)
        return ReplayRobot(open_log(path, None if self.spec is None else read_spec(Path(self.spec))))


class ReplayRobot(Openable):
    """Implements `Robot` and `Recorded` of `hardware.hal`."""

    def __init__(self, log: Log) -> None:
        self._log = log
        self._queues: dict[str, EventQueue[Any]] = {channel: EventQueue[Any]() for channel in CHANNELS}
        self._queues["images"] = EventQueue[Any](IMAGES_KEPT)
        self._clock = ReplayClock(log, self._queues)
        self._pending: dict[str, Subscription[Any]] = {}
        self._held: list[LaserScan] = []
        self._held_images: list[RgbdImage] = []
        self._covered = float("-inf")

    @property
    def log(self) -> Log:
        """The recording: the door to the truth that it may hold, not part of the HAL."""
        return self._log

    @property
    def spec(self) -> RobotSpec:
        """The robot that recorded it."""
        return self._log.spec

    @property
    def clock(self) -> ReplayClock:
        """The recording's clock."""
        return self._clock

    @property
    def queues(self) -> Mapping[str, EventQueue[Any]]:
        """The recorded devices."""
        return self._queues

    @property
    def span(self) -> tuple[float, float]:
        """First and last time on its clock [s]."""
        return self._log.span

    def open(self) -> None:
        """Go to the first reading; an open recording stays where it is.

        Raises:
            RecordingError: the recording cannot be read; nothing is held.
        """
        if self._clock.running:
            return
        self._clock.start()
        for queue in self._queues.values():
            queue.latest = None
        self._pending = {channel: self._queues[channel].subscribe() for channel in SENSORS}
        self._held, self._held_images, self._covered = [], [], float("-inf")

    def close(self) -> None:
        """Let go of the recording. May be called twice."""
        self._clock.stop()
        for channel, subscription in self._pending.items():
            self._queues[channel].unsubscribe(subscription)
        self._pending = {}

    def read(self) -> SensorFrame:
        """Everything since the last read, oldest first; a scan or an image waits for the odometry of its end.

        Raises:
            NotOpenError: outside `open()` .. `close()`.
        """
        self._require_open()
        odometry = cast(list[WheelOdometry], self._pending["odometry"].take())
        imu = cast(list[Imu], self._pending["imu"].take())
        if odometry:
            self._covered = odometry[-1].stamp
        scans, self._held = self._split([*self._held, *cast(list[LaserScan], self._pending["scans"].take())])
        images, self._held_images = self._split([*self._held_images, *cast(list[RgbdImage], self._pending["images"].take())])
        return SensorFrame(self._clock.now(), tuple(odometry), tuple(imu), tuple(scans), self.spec.available, tuple(images))

    def drive(self, twist: Twist) -> Twist:
        """The recorded twist, whatever is asked for.

        Raises:
            NotOpenError: outside `open()` .. `close()`.
        """
        del twist
        self._require_open()
        latest: Command | WheelOdometry | None = self._queues["commands"].latest or self._queues["odometry"].latest
        return Twist() if latest is None else latest.twist

    def health(self) -> Health:
        """Only readings dropped by a full queue can be wrong with a recording."""
        return Health(dropped=sum(subscription.dropped for subscription in self._pending.values()))

    def _split(self, held: list[Lasting]) -> tuple[list[Lasting], list[Lasting]]:
        """Readings that need wait no longer, in order, and the rest."""
        if not held:  # most frames of a recording
            return held, held
        everything = self._clock.ended or self.spec.drive is None
        count = 0
        while count < len(held) and (everything or self._is_ready(held[count])):
            count += 1
        return held[:count], held[count:]

    def _is_ready(self, reading: LaserScan | RgbdImage) -> bool:
        return reading.end <= self._covered or self._clock.now() - reading.end > HOLD_LIMIT

    def _require_open(self) -> None:
        if not self._clock.running:
            raise NotOpenError
