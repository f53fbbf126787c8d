"""What the EV3's byte codes calculate, with the widths and the overflow of its processor."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable

COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    "LT": operator.lt,
    "GT": operator.gt,
    "EQ": operator.eq,
    "NEQ": operator.ne,
    "LTEQ": operator.le,
    "GTEQ": operator.ge,
}


_LOGIC: dict[str, Callable[[int, int], int]] = {"OR": operator.or_, "AND": operator.and_, "XOR": operator.xor}
_ARITHMETIC: dict[str, Callable[[float, float], float]] = {"ADD": operator.add, "SUB": operator.sub, "MUL": operator.mul}


def result(operation: str, left: float, right: float, width: str) -> float:
    """Of ADD, SUB, MUL, DIV, AND, OR or XOR on numbers of a width: 8, 16, 32 or F.

    Raises:
        ZeroDivisionError: an integer is divided by zero.
    """
    if operation in _LOGIC:
        return _LOGIC[operation](int(left), int(right))
    if operation == "DIV":
        return _quotient(left, right) if width == "F" else math.trunc(left / right)
    return _ARITHMETIC[operation](left, right)


def _quotient(left: float, right: float) -> float:
    """As the processor divides."""
    if right == 0.0:
        return math.nan if left == 0.0 else math.copysign(math.inf, left)
    return left / right


def wrapped(value: int, size: int) -> int:
    """The low bytes of an integer, as a signed number."""
    return int.from_bytes((value & (1 << 8 * size) - 1).to_bytes(size, "little"), "little", signed=True)
