"""Formats of recordings by name, imported on use."""

from __future__ import annotations

import importlib
from pathlib import Path

from hardware.errors import RecordingError
from hardware.logs.log import Log
from hardware.spec import RobotSpec

LOG_FORMATS: dict[str, str] = {
    "carmen": "hardware.logs.carmen:CarmenLog",
    "coreslam": "hardware.logs.coreslam:CoreSlamLog",
    "rosbag": "hardware.logs.ros_bag:RosBag",
    "mcap": "hardware.logs.mcap_bag:McapBag",
}
"""name -> "module:Class"; the class implements `hardware.logs.log.Log`. The first that accepts a path reads it."""

_HEAD_BYTES = 4096


def open_log(path: Path, spec: RobotSpec | None = None) -> Log:
    """A recording of any format in `LOG_FORMATS`; a `spec` replaces what it says of its robot.

    Raises:
        RecordingError: it is missing, of no known format, or cannot be used.
    """
    head = _head(path)
    for target in LOG_FORMATS.values():
        module, _, attribute = target.partition(":")
        log: type[Log] = getattr(importlib.import_module(module), attribute)
        if log.accepts(path, head):
            return log.load(path, spec)
    raise RecordingError(path, f"of no known format; known: {', '.join(LOG_FORMATS)}")


def _head(path: Path) -> bytes:
    """First bytes of a file; nothing for a folder."""
    if path.is_dir():
        return b""
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except OSError as error:
        raise RecordingError(path, f"cannot be read: {error.strerror}") from error
    if not head:
        raise RecordingError(path, "the file is empty")
    return head
