"""MCAP files (https://mcap.dev/spec) as they are found: finished, or cut where their writer was killed."""

from __future__ import annotations

import logging
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import breakup_chunk
from zstandard import ZstdError

from hardware.errors import RecordingError

_log = logging.getLogger(__name__)

MAGIC = b"\x89MCAP0\r\n"
_FRAME = struct.Struct("<BQ")
_OPCODES = frozenset(int(opcode) for opcode in Opcode)
_PRIVATE_OPCODES = 0x80
_CORRUPTION = (McapError, ZstdError, RuntimeError, ValueError, struct.error, MemoryError, OverflowError)
"""RuntimeError is what LZ4 raises."""


@dataclass(frozen=True, slots=True)
class McapMessage:
    """One message, still encoded."""

    topic: str
    type: str
    log_time_ns: int
    content: bytes


class McapFile:
    """The complete chunks of a file, in file order.

    Raises:
        RecordingError: there is nothing readable in it.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._chunks: list[tuple[int, int]] = []
        with self._open() as file:
            self._index(file, path.stat().st_size)
        if not self._chunks:
            raise RecordingError(path, "holds no complete chunk of messages; it was cut in its first second, or is no rosbag2")

    def messages(self) -> Iterator[McapMessage]:
        """Every message, chunk by chunk.

        Raises:
            RecordingError: a chunk is corrupt; the message says how much before it can be read.
        """
        types: dict[int, str] = {}
        channels: dict[int, Channel] = {}
        last_ns = 0
        with self._open() as file:
            for start, length in self._chunks:
                for record in self._records(file, start, length, last_ns):
                    if isinstance(record, Schema):
                        types[record.id] = record.name
                    elif isinstance(record, Channel):
                        channels[record.id] = record
                    elif isinstance(record, Message) and record.channel_id in channels:
                        channel, last_ns = channels[record.channel_id], record.log_time
                        yield McapMessage(channel.topic, types.get(channel.schema_id, ""), last_ns, record.data)

    def _open(self) -> BinaryIO:
        try:
            return self._path.open("rb")
        except OSError as error:
            raise RecordingError(self._path, f"cannot be read: {error.strerror}") from error

    def _records(self, file: BinaryIO, start: int, length: int, last_ns: int) -> list[McapRecord]:
        file.seek(start + _FRAME.size)
        body = file.read(length)
        try:
            return breakup_chunk(Chunk.read(ReadDataStream(BytesIO(body))), validate_crc=True)
        except _CORRUPTION as error:
            raise RecordingError(self._path, _corrupt(start, str(error) or type(error).__name__, last_ns)) from error

    def _index(self, file: BinaryIO, size: int) -> None:
        """Find the chunks; a file without its end is used up to its last complete record."""
        if file.read(len(MAGIC)) != MAGIC:
            raise RecordingError(self._path, f"does not start with {MAGIC!r}; it is no MCAP file")
        at = len(MAGIC)
        while at + _FRAME.size <= size:
            file.seek(at)
            opcode, length = _FRAME.unpack(file.read(_FRAME.size))
            if opcode not in _OPCODES and opcode < _PRIVATE_OPCODES:
                raise RecordingError(self._path, _corrupt(at, f"no record has the code {opcode}", 0))
            if opcode == Opcode.FOOTER:
                return
            if at + _FRAME.size + length > size:
                break
            if opcode == Opcode.CHUNK:
                self._chunks.append((at, length))
            at += _FRAME.size + length
        if self._chunks:
            _log.warning(
                "%s: was not finished; its %d complete chunks are used, %d bytes after them are not",
                self._path,
                len(self._chunks),
                size - at,
            )


def _corrupt(start: int, cause: str, last_ns: int) -> str:
    readable = f"what is before it, up to {last_ns * 1e-9:.3f} s, is whole" if last_ns else "nothing before it was read"
    return f"is corrupt at byte {start} ({cause}); {readable}: cut the file there (head -c {start}) to use that"
