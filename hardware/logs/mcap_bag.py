"""Our own recordings: a rosbag2 folder or run folder with `recording.mcap`, or the file alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Self

import numpy as np

from hardware.errors import RecordingError
from hardware.logs.exact import NANOSECONDS
from hardware.logs.log import Event
from hardware.logs.mcap_file import MAGIC, McapFile
from hardware.logs.ros_reading import ReadingDecoder, read_text, read_truth
from hardware.logs.ros_types import TOPICS
from hardware.logs.spec_file import parse_spec
from hardware.logs.stamps import StampOrder
from hardware.spec import RobotSpec
from slam.messages import Trajectory

RECORDING = "recording.mcap"
UNFINISHED = RECORDING + ".part"
"""Name of a recording that is being written, or whose writer was killed."""


class McapBag:
    """One MCAP file of ours. Implements `hardware.logs.log.Log`; readings are decoded as they are asked for."""

    def __init__(self, path: Path, spec: RobotSpec | None = None) -> None:
        self._path = path
        self._file = McapFile(path)
        self._counts: Counter[str] = Counter()
        self._texts: dict[str, str] = {}
        self._span_ns = (0, 0)
        self._truth: list[tuple[float, float, float, float]] = []
        self._survey()
        self._spec = spec or self._recorded_spec()
        self._check()

    @classmethod
    def accepts(cls, path: Path, head: bytes) -> bool:
        """Whether it is a folder, or a file that is or calls itself MCAP."""
        return path.is_dir() or head.startswith(MAGIC) or path.name.endswith((".mcap", ".mcap.part"))

    @classmethod
    def load(cls, path: Path, spec: RobotSpec | None) -> Self:
        """Open a file, or the recording in a folder; one that is unfinished is newer than a finished one beside it."""
        if not path.is_dir():
            return cls(path, spec)
        found = [file for file in (path / UNFINISHED, path / RECORDING, *sorted(path.glob("*.mcap"))) if file.is_file()]
        if not found:
            raise RecordingError(path, f"no {RECORDING} in this folder; was the run made with --record?")
        return cls(found[0], spec)

    @property
    def spec(self) -> RobotSpec:
        """The robot that recorded it."""
        return self._spec

    @property
    def span(self) -> tuple[float, float]:
        """First and last arrival [s]."""
        return self._span_ns[0] / NANOSECONDS, self._span_ns[1] / NANOSECONDS

    def events(self) -> Iterator[Event]:
        """Every reading in file order.

        Raises:
            RecordingError: a reading that cannot be used.
        """
        return self._read(StampOrder())

    def truth(self) -> Trajectory | None:
        """`T_world_base` over time, where the recording has it."""
        if not self._truth:
            return None
        rows = np.array(self._truth)
        return Trajectory(rows[:, 0], rows[:, 1:])

    def description(self) -> str:
        """The robot's URDF, or nothing."""
        return self._texts.get("/robot_description", "")

    def _read(self, order: StampOrder) -> Iterator[Event]:
        decoder = ReadingDecoder(self._spec)
        for number, message in enumerate(self._file.messages()):
            try:
                found = decoder.read(message.topic, message.content)
                if found is None:
                    continue
                channel, reading = found
                stamp, arrival = order.place(channel, reading.stamp, message.log_time_ns / NANOSECONDS)
            except ValueError as error:
                raise RecordingError(self._path, f"message {number}, on {message.topic}: {error}") from error
            yield Event(arrival, channel, reading if stamp == reading.stamp else replace(reading, stamp=stamp))

    def _survey(self) -> None:
        """Count the topics; keep what is no reading."""
        for number, message in enumerate(self._file.messages()):
            topic = TOPICS.get(message.topic)
            if topic is not None and topic.type != message.type:
                raise RecordingError(self._path, f"topic {message.topic} is a {message.type}, must be a {topic.type}")
            if not self._counts:
                self._span_ns = message.log_time_ns, message.log_time_ns
            self._counts[message.topic] += 1
            self._span_ns = self._span_ns[0], max(self._span_ns[1], message.log_time_ns)
            try:
                self._keep(message.topic, message.content)
            except ValueError as error:
                raise RecordingError(self._path, f"message {number}, on {message.topic}: {error}") from error

    def _keep(self, topic: str, content: bytes) -> None:
        if topic == "/ground_truth":
            stamp, T_world_base = read_truth(content)
            self._truth.append((stamp, T_world_base.x, T_world_base.y, T_world_base.yaw))
        elif topic in ("/robot_spec", "/robot_description"):
            self._texts[topic] = read_text(content)

    def _recorded_spec(self) -> RobotSpec:
        if "/robot_spec" not in self._texts:
            raise RecordingError(self._path, f"no topic /robot_spec among {self._topics()}; name a robot specification (spec)")
        return parse_spec(self._texts["/robot_spec"])

    def _check(self) -> None:
        """Read it all once, so that what is wrong is said before a run has started."""
        if not self._counts["/scan"]:
            raise RecordingError(self._path, f"no scans (/scan); it has {self._topics()}")
        order = StampOrder()
        for _ in self._read(order):
            pass
        order.report(self._path)

    def _topics(self) -> str:
        return ", ".join(f"{topic} ({count})" for topic, count in sorted(self._counts.items())) or "no messages"
