"""CDR, the encoding of ROS 2 messages: every number aligned to its own size, counted from after a header of four bytes.

A layout names a message's fields in order, nested ones unfolded: `i I f d` a number as in `struct`, `7d` an array of fixed
length, `d*` a sequence, `s` a string, `s*` a sequence of strings. OMG, "DDS-XTypes" 1.3, section 7.4.1 (PLAIN_CDR).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

HEADER = b"\x00\x01\x00\x00"
"""Plain CDR, little-endian."""


def encode(layout: str, *values: object) -> bytes:
    """A message of this layout. A number may be a scalar, an array is anything that numpy takes.

    Raises:
        ValueError: the values do not fit the layout.
    """
    message = bytearray(HEADER)
    for token, value in zip(layout.split(), values, strict=True):
        _put(message, token, value)
    return bytes(message)


def decode(layout: str, message: bytes) -> list[Any]:
    """The values of a message: int, float, str, list of str, or array.

    Raises:
        ValueError: the message is not of this layout.
    """
    if message[:2] != HEADER[:2]:
        raise ValueError(f"the message's encoding is {message[:4]!r}; only little-endian CDR is known")
    cursor = _Cursor(message)
    return [cursor.take(token) for token in layout.split()]


def _put(message: bytearray, token: str, value: object) -> None:
    if token == "s*":
        texts = cast(Sequence[str], value)
        _put(message, "I", len(texts))
        for text in texts:
            _put(message, "s", text)
    elif token == "s":
        text = str(value).encode() + b"\0"
        _put(message, "I", len(text))
        message += text
    else:
        _put_numbers(message, token, np.asarray(value, dtype=_kind(token)).reshape(-1))


def _put_numbers(message: bytearray, token: str, numbers: NDArray[Any]) -> None:
    if token.endswith("*"):
        _put(message, "I", len(numbers))
    elif len(numbers) != _length(token):
        raise ValueError(f"{len(numbers)} numbers for the field '{token}'")
    if len(numbers):
        message += b"\0" * (-(len(message) - len(HEADER)) % numbers.itemsize) + numbers.tobytes()


@cache
def _kind(token: str) -> np.dtype[Any]:
    return np.dtype("<" + token.strip("0123456789*"))


@cache
def _length(token: str) -> int:
    return int(token[:-1] or 1)


class _Cursor:
    """A place in a message, moving forward."""

    def __init__(self, message: bytes) -> None:
        self._message = message
        self._at = len(HEADER)

    def take(self, token: str) -> int | float | str | Sequence[str] | NDArray[Any]:
        if token == "s":
            return self._text()
        if token == "s*":
            return [self._text() for _ in range(self._count())]
        if token.endswith("*"):
            return self._numbers(_kind(token), self._count())
        numbers = self._numbers(_kind(token), _length(token))
        return numbers if len(token) > 1 else numbers[0].item()

    def _count(self) -> int:
        return int(self._numbers(np.dtype("<I"), 1)[0])

    def _text(self) -> str:
        size, start = self._count(), self._at
        self._at += size
        if size == 0 or self._at > len(self._message):
            raise ValueError(f"a string of {size} bytes in a message of {len(self._message)}")
        return self._message[start : self._at - 1].decode()

    def _numbers(self, kind: np.dtype[Any], count: int) -> NDArray[Any]:
        if count == 0:
            return np.empty(0, kind)
        self._at += -(self._at - len(HEADER)) % kind.itemsize
        start, self._at = self._at, self._at + count * kind.itemsize
        if self._at > len(self._message):
            raise ValueError(f"{count} numbers at byte {start} of a message of {len(self._message)}")
        return np.frombuffer(self._message, kind, count, start)
