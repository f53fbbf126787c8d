"""Records what a robot's devices report, as a rosbag2 that any ROS tool opens and `replay` gives back."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Self

from hardware.errors import RecordingError
from hardware.hal import Robot
from hardware.logs import ros_writing
from hardware.logs.exact import nanoseconds
from hardware.logs.mcap_writer import BagWriter
from hardware.logs.spec_file import write_spec
from slam.se2 import SE2

_log = logging.getLogger(__name__)

CHUNK_PERIOD = 0.9
"""Time after which a chunk is closed [s] on the robot's clock: with a tick to spare, a kill loses less than a second."""


class Recorder:
    """Subscribes to the queues of an open robot; the loop calls `flush` once a tick, after it has driven.

    The recording is `recording.mcap.part` in its folder until it is closed, then `recording.mcap` with its `metadata.yaml`.

    Raises:
        RecordingError: the folder cannot be written; nothing is held.
    """

    def __init__(self, robot: Robot, folder: Path, urdf: str) -> None:
        self._robot = robot
        self._folder = folder
        self._writer: BagWriter | None = BagWriter(folder)
        self._subscriptions = {channel: queue.subscribe() for channel, queue in robot.queues.items()}
        now = robot.clock.now()
        self._chunk_start = now
        self._write(
            [
                ros_writing.text("/robot_spec", write_spec(robot.spec)),
                ros_writing.text("/robot_description", urdf),
                ros_writing.mounts(robot.spec, now),
            ]
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def flush(self) -> None:
        """Write what has been reported since the last call; once a second, make it survive this process.

        Raises:
            RecordingError: it cannot be written; what was written stays readable.
        """
        for subscription in self._subscriptions.values():
            for reading in subscription.take():
                self._write(ros_writing.written(reading))
        now = self._robot.clock.now()
        if now - self._chunk_start >= CHUNK_PERIOD:
            self._chunk_start = now
            self._guard(self._open_writer().flush)

    def add_truth(self, stamp: float, x: float, y: float, yaw: float) -> None:
        """Record the true pose in `world` at `stamp` [s, m, rad], as a topic of its own that no `Robot` gives back."""
        self._write([ros_writing.ground_truth(stamp, SE2(x, y, yaw))])

    def close(self) -> None:
        """Finish the recording: footer, final name, `metadata.yaml`. May be called twice.

        Raises:
            RecordingError: it cannot be written; what was written stays readable.
        """
        if self._writer is None:
            return
        self.flush()
        self._guard(self._writer.finish)
        self._let_go()

    def _write(self, messages: Iterable[tuple[str, bytes]]) -> None:
        writer, now_ns = self._open_writer(), nanoseconds(self._robot.clock.now())
        for topic, message in messages:
            writer.write(topic, now_ns, message)

    def _guard(self, action: Callable[[], None]) -> None:
        try:
            action()
        except OSError as error:
            self._open_writer().abandon()
            self._let_go()
            raise RecordingError(self._folder, f"cannot be written on: {error.strerror}; what was written stays readable") from error

    def _let_go(self) -> None:
        """Leave the queues alone again."""
        lost = 0
        for channel, subscription in self._subscriptions.items():
            self._robot.queues[channel].unsubscribe(subscription)
            lost += subscription.dropped
        if lost:
            _log.warning("%s: %d readings were not recorded, they came faster than they were written", self._folder, lost)
        self._subscriptions = {}
        self._writer = None

    def _open_writer(self) -> BagWriter:
        if self._writer is None:
            raise RecordingError(self._folder, "is closed; start another one")
        return self._writer
