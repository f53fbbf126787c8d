"""A rosbag2 folder in the making: chunks that survive the writer, then the footer, the final name and `metadata.yaml`."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import IO, Any, cast

import yaml
from mcap.writer import CompressionType, Writer

from hardware.errors import RecordingError
from hardware.logs.mcap_bag import RECORDING, UNFINISHED
from hardware.logs.ros_types import TOPICS, definition

METADATA = "metadata.yaml"
LATCHED_QOS = """\
- history: 1
  depth: 1
  reliability: 1
  durability: 1
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: 1
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
"""
"""Reliable and transient local, as rosbag2 writes it: a player then serves tf_static and the description to late comers."""
_LARGEST_CHUNK_BYTES = 4 * 1024 * 1024
"""A chunk is compressed by whoever writes its last message: 5 ms for so many bytes of images with LZ4, 40 ms with zstd."""


class BagWriter:
    """Writes messages into a folder that is made if missing. Nothing touches the file between two calls of `flush`.

    Raises:
        RecordingError: the folder cannot be written; nothing is held.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._counts: Counter[str] = Counter()
        self._times_ns = (0, 0)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file = _WholeWrites(folder / UNFINISHED)
        except OSError as error:
            raise RecordingError(folder, f"cannot be written: {error.strerror}; name another folder") from error
        self._mcap = Writer(
            cast("IO[bytes]", self._file),  # it is only written, told and flushed
            _LARGEST_CHUNK_BYTES,
            CompressionType.LZ4,
        )
        self._mcap.start(profile="ros2", library="bricktwin")
        self._channels: dict[str, int] = {}

    def write(self, topic: str, log_time_ns: int, message: bytes) -> None:
        """Add one message to the chunk in hand."""
        if not self._counts:
            self._times_ns = log_time_ns, log_time_ns
        self._times_ns = self._times_ns[0], max(self._times_ns[1], log_time_ns)
        self._counts[topic] += 1
        if topic not in self._channels:
            self._channels[topic] = self._register(topic)
        self._mcap.add_message(self._channels[topic], log_time_ns, message, log_time_ns)

    def flush(self) -> None:
        """Close the chunk and hand it to the system; from here on it survives this process.

        Raises:
            OSError: the disk is full.
        """
        self._mcap.flush()

    def finish(self) -> None:
        """Write the rest, the index and the footer; give the file its name; then `metadata.yaml`.

        Raises:
            OSError: the disk is full; the complete chunks stay readable under the unfinished name.
        """
        self._mcap.finish()
        self._file.flush()
        self._file.close()
        (self._folder / UNFINISHED).replace(self._folder / RECORDING)
        partial = self._folder / (METADATA + ".part")
        partial.write_text(yaml.safe_dump({"rosbag2_bagfile_information": self._metadata()}, sort_keys=False))
        partial.replace(self._folder / METADATA)

    def abandon(self) -> None:
        """Close the file as it is."""
        self._file.close()

    def _register(self, topic: str) -> int:
        kind = TOPICS[topic]
        schema = self._mcap.register_schema(kind.type, "ros2msg", definition(kind.type).encode())
        return self._mcap.register_channel(topic, "cdr", schema, {"offered_qos_profiles": _qos(topic)})

    def _metadata(self) -> dict[str, Any]:
        """As rosbag2 of ROS 2 Humble and later reads it."""
        return {
            "version": 5,
            "storage_identifier": "mcap",
            **self._extent(),
            "topics_with_message_count": [
                {"topic_metadata": _topic_metadata(topic), "message_count": count} for topic, count in self._counts.items()
            ],
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [RECORDING],
            "files": [{"path": RECORDING, **self._extent()}],
        }

    def _extent(self) -> dict[str, Any]:
        start, end = self._times_ns
        return {
            "starting_time": {"nanoseconds_since_epoch": start},
            "duration": {"nanoseconds": end - start},
            "message_count": sum(self._counts.values()),
        }


def _qos(topic: str) -> str:
    return LATCHED_QOS if TOPICS[topic].latched else ""


def _topic_metadata(topic: str) -> dict[str, str]:
    return {"name": topic, "type": TOPICS[topic].type, "serialization_format": "cdr", "offered_qos_profiles": _qos(topic)}


class _WholeWrites:
    """A file that is written only by `flush`, so that a full disk is met there and not when the file is closed."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("wb", buffering=0)
        self._pending = bytearray()
        self._written = 0

    def write(self, content: bytes) -> int:
        self._pending += content
        return len(content)

    def tell(self) -> int:
        return self._written + len(self._pending)

    def flush(self) -> None:
        while self._pending:
            count = self._file.write(self._pending)
            del self._pending[:count]
            self._written += count

    def close(self) -> None:
        self._file.close()
