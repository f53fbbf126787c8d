"""Bytes that are not what the protocol allows."""

from __future__ import annotations

from hardware.errors import HardwareError


class ProtocolError(HardwareError):
    """A message that cannot be understood."""

    def __init__(self, protocol: str, problem: str, message: bytes = b"") -> None:
        shown = message[:24].hex(" ") + (" ..." if len(message) > 24 else "")
        super().__init__(f"{protocol}: {problem}" + (f", got {shown}" if message else ""))
