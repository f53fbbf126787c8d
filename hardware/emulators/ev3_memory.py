"""Variables of a direct command: what it shares with its reply, and its own."""

from __future__ import annotations

import math
import struct

from hardware.emulators.ev3_arithmetic import wrapped
from hardware.protocols.ev3_codes import Argument, Variable

FORMATS = {"8": "<b", "16": "<h", "32": "<i", "F": "<f"}
NO_DATA = {"<b": -128, "<h": -32768, "<i": -0x80000000, "<f": math.nan}


class MachineError(Exception):
    """An instruction that the brick cannot carry out."""


class Memory:
    """Global and local bytes. Every method raises `MachineError` for an argument that it cannot be."""

    def __init__(self, global_bytes: int, local_bytes: int) -> None:
        self._globals = bytearray(global_bytes)
        self._locals = bytearray(local_bytes)

    @property
    def values(self) -> bytes:
        """What goes into the reply."""
        return bytes(self._globals)

    def write(self, given: tuple[Argument, ...], text: str) -> None:
        """Put a text where (size, place) say."""
        size, place = self.integer(given[0]), given[1]
        if not isinstance(place, Variable):
            raise MachineError
        memory = self._memory(place, size)
        memory[place.offset : place.offset + size] = text.encode("ascii")[: size - 1].ljust(size, b"\0")

    def integer(self, argument: Argument) -> int:
        """The argument as a whole number."""
        if isinstance(argument, str):
            raise MachineError
        wide = not isinstance(argument, Variable) or self._fits(argument, 4)
        return int(self.load(argument, "<i" if wide else "<b"))

    def _fits(self, place: Variable, size: int) -> bool:
        return place.offset + size <= len(self._locals if place.local else self._globals)

    def load(self, argument: Argument, layout: str) -> float:
        """The number that an argument is, or that stands in its variable."""
        if isinstance(argument, str):
            raise MachineError
        if isinstance(argument, Variable):
            return struct.unpack_from(layout, self._memory(argument, struct.calcsize(layout)), argument.offset)[0]
        return argument

    def store(self, place: Argument, value: float, layout: str) -> None:
        """Put a number into a variable; an integer keeps its low bytes."""
        if not isinstance(place, Variable):
            raise MachineError
        if layout != "<f":
            value = NO_DATA[layout] if not math.isfinite(value) else wrapped(round(value), struct.calcsize(layout))
        struct.pack_into(layout, self._memory(place, struct.calcsize(layout)), place.offset, value)

    def _memory(self, place: Variable, size: int) -> bytearray:
        if not self._fits(place, size):
            raise MachineError
        return self._locals if place.local else self._globals
