"""Byte codes of the EV3's virtual machine: instructions to bytes and back (lms2012, bytecodes.h and lms2012.c)."""

from __future__ import annotations

import struct
from typing import NamedTuple

from hardware.protocols.errors import ProtocolError


class Variable(NamedTuple):
    """Place of a value on the brick: in the reply (global) or in the command's own memory (local)."""

    offset: int
    """[bytes]"""
    local: bool = False


Argument = int | str | Variable


class Instruction(NamedTuple):
    """One instruction with its arguments in the order of the byte code."""

    name: str
    arguments: tuple[Argument, ...] = ()


class Code(NamedTuple):
    """How an instruction looks in bytes."""

    opcode: bytes
    """One byte, or two with a subcode."""
    parameters: int
    """How many arguments follow."""
    counted: bool = False
    """The last of them says how many more follow."""


CODES: dict[str, Code] = {
    "NOP": Code(b"\x01", 0),
    "OBJECT_END": Code(b"\x0a", 0),
    "OUTPUT_RESET": Code(b"\xa2", 2),
    "OUTPUT_STOP": Code(b"\xa3", 3),
    "OUTPUT_POWER": Code(b"\xa4", 3),
    "OUTPUT_SPEED": Code(b"\xa5", 3),
    "OUTPUT_START": Code(b"\xa6", 2),
    "OUTPUT_POLARITY": Code(b"\xa7", 3),
    "OUTPUT_READ": Code(b"\xa8", 4),
    "OUTPUT_TEST": Code(b"\xa9", 3),
    "OUTPUT_READY": Code(b"\xaa", 2),
    "OUTPUT_STEP_POWER": Code(b"\xac", 7),
    "OUTPUT_TIME_POWER": Code(b"\xad", 7),
    "OUTPUT_STEP_SPEED": Code(b"\xae", 7),
    "OUTPUT_TIME_SPEED": Code(b"\xaf", 7),
    "OUTPUT_STEP_SYNC": Code(b"\xb0", 6),
    "OUTPUT_TIME_SYNC": Code(b"\xb1", 6),
    "OUTPUT_CLR_COUNT": Code(b"\xb2", 2),
    "OUTPUT_GET_COUNT": Code(b"\xb3", 3),
    "INPUT_GET_TYPEMODE": Code(b"\x99\x05", 4),
    "INPUT_CLR_ALL": Code(b"\x99\x0a", 1),
    "INPUT_CLR_CHANGES": Code(b"\x99\x1a", 2),
    "INPUT_READY_PCT": Code(b"\x99\x1b", 5, counted=True),
    "INPUT_READY_RAW": Code(b"\x99\x1c", 5, counted=True),
    "INPUT_READY_SI": Code(b"\x99\x1d", 5, counted=True),
    "INPUT_READ": Code(b"\x9a", 5),
    "INPUT_READSI": Code(b"\x9d", 5),
    "UI_READ_GET_VBATT": Code(b"\x81\x01", 1),
    "UI_READ_GET_IBATT": Code(b"\x81\x02", 1),
    "UI_READ_GET_LBATT": Code(b"\x81\x12", 1),
    "UI_READ_GET_OS_VERS": Code(b"\x81\x03", 2),
    "UI_READ_GET_HW_VERS": Code(b"\x81\x09", 2),
    "UI_READ_GET_FW_VERS": Code(b"\x81\x0a", 2),
    "UI_READ_GET_FW_BUILD": Code(b"\x81\x0b", 2),
    "UI_READ_GET_OS_BUILD": Code(b"\x81\x0c", 2),
    "COM_GET_BRICKNAME": Code(b"\xd3\x0d", 2),
    "COM_GET_NETWORK": Code(b"\xd3\x0e", 5),
    "INFO_GET_VOLUME": Code(b"\x7c\x04", 1),
    "INFO_GET_MINUTES": Code(b"\x7c\x06", 1),
    "MEMORY_USAGE": Code(b"\xc5", 2),
    "UI_WRITE_LED": Code(b"\x82\x1b", 1),
    "SOUND_TONE": Code(b"\x94\x01", 3),
    "TIMER_WAIT": Code(b"\x85", 2),
    "TIMER_READY": Code(b"\x86", 1),
    "TIMER_READ": Code(b"\x87", 1),
    "JR": Code(b"\x40", 1),
    "JR_FALSE": Code(b"\x41", 2),
    "JR_TRUE": Code(b"\x42", 2),
    "MATH_ABS": Code(b"\x8d\x06", 2),
}
WIDTHS = ("8", "16", "32", "F")
"""Kinds of numbers, in the order in which the opcodes of one operation follow each other."""
for _first, _operation in ((0x10, "ADD"), (0x14, "SUB"), (0x18, "MUL"), (0x1C, "DIV"), (0x20, "OR"), (0x24, "AND"), (0x28, "XOR")):
    for _k, _width in enumerate(WIDTHS[:3] if _first >= 0x20 else WIDTHS):
        CODES[_operation + _width] = Code(bytes([_first + _k]), 3)
for _k, _source in enumerate(WIDTHS):
    for _j, _target in enumerate(WIDTHS):
        CODES[f"MOVE{_source}_{_target}"] = Code(bytes([0x30 + 4 * _k + _j]), 2)
COMPARISONS = ("LT", "GT", "EQ", "NEQ", "LTEQ", "GTEQ")
for _k, _comparison in enumerate(COMPARISONS):
    for _j, _width in enumerate(WIDTHS):
        CODES[f"CP_{_comparison}{_width}"] = Code(bytes([0x44 + 4 * _k + _j]), 3)
        CODES[f"JR_{_comparison}{_width}"] = Code(bytes([0x64 + 4 * _k + _j]), 3)

_NAMES = {code.opcode: name for name, code in CODES.items()}
_GROUPS = {code.opcode[0] for code in CODES.values() if len(code.opcode) == 2}
_LONG = {1: "<b", 2: "<h", 3: "<i"}
"""Format of what follows, by the three low bits of a long argument."""
_STRINGS = (0x80, 0x84)


def encode(*instructions: Instruction) -> bytes:
    """The byte codes of instructions, one after the other.

    Raises:
        ProtocolError: an instruction or an argument that the brick does not have.
    """
    return b"".join(_encode_one(instruction) for instruction in instructions)


def decode(codes: bytes) -> list[Instruction]:
    """The instructions of byte codes.

    Raises:
        ProtocolError: they are cut or unknown.
    """
    place, found = 0, list[Instruction]()
    while place < len(codes):
        instruction, place = decode_at(codes, place)
        found.append(instruction)
    return found


def decode_at(codes: bytes, place: int) -> tuple[Instruction, int]:
    """The instruction that starts at `place`, and where the next one starts.

    Raises:
        ProtocolError: it is cut or unknown.
    """
    length = 2 if _byte(codes, place) in _GROUPS else 1
    name = _NAMES.get(codes[place : place + length])
    if name is None:
        raise ProtocolError("EV3", "unknown or cut byte code", codes[place : place + 2])
    code, here = CODES[name], place + length
    arguments: list[Argument] = []
    expected = code.parameters
    while len(arguments) < expected:
        argument, here = _decode_argument(codes, here)
        arguments.append(argument)
        if code.counted and len(arguments) == code.parameters:
            expected += _count(argument)
    return Instruction(name, tuple(arguments)), here


def encode_argument(argument: Argument) -> bytes:
    """One argument in its shortest form: LC0 to LC4, LCS, GV0 to GV4, LV0 to LV4.

    Raises:
        ProtocolError: it does not fit into 32 bits, a text holds a zero.
    """
    if isinstance(argument, Variable):
        return _encode_variable(argument)
    if isinstance(argument, str):
        text = argument.encode("latin-1", "replace")
        if b"\0" in text:
            raise ProtocolError("EV3", f"a text cannot hold a zero, got {argument!r}")
        return b"\x84" + text + b"\0"
    if -32 <= argument <= 31:
        return bytes([argument & 0x3F])
    for form, limit in ((1, 0x7F), (2, 0x7FFF), (3, 0x7FFFFFFF)):
        if -limit <= argument <= limit:  # the most negative number of each size means "no data"
            return bytes([0x80 | form]) + struct.pack(_LONG[form], argument)
    if argument == -0x80000000:
        return b"\x83" + struct.pack("<i", argument)
    raise ProtocolError("EV3", f"a constant has 32 bits, got {argument}")


def _encode_one(instruction: Instruction) -> bytes:
    code = CODES.get(instruction.name)
    if code is None:
        raise ProtocolError("EV3", f"no instruction '{instruction.name}'")
    given = instruction.arguments
    expected = code.parameters
    if code.counted and len(given) >= expected:
        expected += _count(given[expected - 1])
    if len(given) != expected:
        raise ProtocolError("EV3", f"{instruction.name} takes {expected} arguments, got {len(given)}")
    return code.opcode + b"".join(map(encode_argument, given))


def _encode_variable(variable: Variable) -> bytes:
    short, long = (0x40, 0xC0) if variable.local else (0x60, 0xE0)
    if 0 <= variable.offset <= 31:
        return bytes([short | variable.offset])
    if 31 < variable.offset <= 0xFF:
        return bytes([long | 1, variable.offset])
    if 0xFF < variable.offset <= 0x7FFF:
        return bytes([long | 2]) + struct.pack("<h", variable.offset)
    raise ProtocolError("EV3", f"a variable lies within 0 and 32767, got {variable.offset}")


def _decode_argument(codes: bytes, place: int) -> tuple[Argument, int]:
    first = _byte(codes, place)
    if not first & 0x80:
        if first & 0x40:
            return Variable(first & 0x1F, local=not first & 0x20), place + 1
        return (first & 0x3F) - (0x40 if first & 0x20 else 0), place + 1
    if first in _STRINGS:
        end = codes.find(b"\0", place + 1)
        if end < 0:
            raise ProtocolError("EV3", "a text without its end", codes[place:])
        return codes[place + 1 : end].decode("latin-1"), end + 1
    return _decode_long(codes, place, first)


def _decode_long(codes: bytes, place: int, first: int) -> tuple[Argument, int]:
    layout = _LONG.get(first & 0x07)
    if layout is None or first & 0x18:
        raise ProtocolError("EV3", "unknown form of an argument", codes[place : place + 1])
    size = struct.calcsize(layout)
    field = codes[place + 1 : place + 1 + size]
    if len(field) < size:
        raise ProtocolError("EV3", "an argument is cut", codes[place:])
    value = int.from_bytes(field, "little", signed=not first & 0x40)
    argument = Variable(value, local=not first & 0x20) if first & 0x40 else value
    return argument, place + 1 + size


def _count(argument: Argument) -> int:
    if not isinstance(argument, int) or not 0 <= argument <= 64:
        raise ProtocolError("EV3", f"a number of values is a constant within 0 and 64, got {argument}")
    return argument


def _byte(codes: bytes, place: int) -> int:
    if not 0 <= place < len(codes):
        raise ProtocolError("EV3", "byte codes are cut", codes)
    return codes[place]
