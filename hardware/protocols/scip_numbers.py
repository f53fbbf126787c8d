"""Numbers of SCIP 2.0: characters of 6 bits each (specification C-42-03320B)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hardware.protocols.errors import ProtocolError


def encode_number(value: int, size: int) -> str:
    """A number in `size` characters of 6 bits each, the most significant first.

    Raises:
        ProtocolError: it does not fit.
    """
    if not 0 <= value < 1 << 6 * size:
        raise ProtocolError("SCIP", f"{value} does not fit into {size} characters")
    return "".join(chr((value >> 6 * k & 0x3F) + 0x30) for k in range(size - 1, -1, -1))


def decode_number(text: str) -> int:
    """The number of characters of 6 bits each.

    Raises:
        ProtocolError: a character that no number has.
    """
    return int(decode_numbers(text, len(text))[0])


def encode_numbers(values: NDArray[np.int64], size: int) -> str:
    """Numbers (N,) in `size` characters each.

    Raises:
        ProtocolError: one does not fit.
    """
    if values.size and not 0 <= values.min() <= values.max() < 1 << 6 * size:
        raise ProtocolError("SCIP", f"numbers within {values.min()} and {values.max()} do not fit into {size} characters")
    shifts = 6 * np.arange(size - 1, -1, -1)
    return ((values[:, None] >> shifts & 0x3F) + 0x30).astype(np.uint8).tobytes().decode("ascii")


def decode_numbers(text: str, size: int) -> NDArray[np.int64]:
    """Numbers (N,) of `size` characters each.

    Raises:
        ProtocolError: a character that no number has, or one too many.
    """
    digits = np.frombuffer(text.encode("latin-1", "replace"), np.uint8).astype(np.int64) - 0x30
    if digits.size == 0 or digits.size % size or digits.min() < 0 or digits.max() > 0x3F:
        raise ProtocolError("SCIP", f"not numbers of {size} characters", text.encode("latin-1", "replace"))
    return digits.reshape(-1, size) @ (1 << 6 * np.arange(size - 1, -1, -1))
