"""Errors of the emulators."""

from __future__ import annotations

from hardware.errors import HardwareError


class EmulatorError(HardwareError):
    """An emulator that cannot be started."""
