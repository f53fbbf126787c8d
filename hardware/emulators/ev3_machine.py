"""The EV3's virtual machine: carries out the byte codes of a direct command (lms2012)."""

from __future__ import annotations

import math
import operator
import struct
from collections.abc import Callable, Generator
from typing import Protocol

from hardware.emulators.ev3_motors import Chassis, Motor, Move, synchronise
from hardware.emulators.ev3_sensors import Inputs, Sensing
from hardware.protocols.errors import ProtocolError
from hardware.protocols.ev3_codes import WIDTHS, Argument, Instruction, Variable, decode_at
from hardware.protocols.ev3_direct import Request

FORMATS = {"8": "<b", "16": "<h", "32": "<i", "F": "<f"}
NO_DATA = {"<b": -128, "<h": -32768, "<i": -0x80000000, "<f": math.nan}
OUTPUTS = 4
LONGEST = 20000
"""Instructions without a pause after which a command is taken for an endless loop."""
NAME = "EV3"
NETWORK = ("bricktwin", "001653000000", "127.0.0.1")
"""Name, hardware address, IP address."""
VERSIONS = {"OS": "Linux 2.6.33-rc", "HW": "V0.60", "FW": "V1.10E", "FW_BUILD": "1902191551", "OS_BUILD": "1801231233"}
Waiting = Generator[None, None, bool]
"""Runs on while the instruction waits; returns whether all went well."""


class Body(Chassis, Sensing, Protocol):
    """What the brick is built into."""

    def battery(self) -> tuple[float, float]:
        """Voltage [V] and current [A]."""
        ...


class MachineError(Exception):
    """An instruction that the brick cannot carry out."""


class Machine:
    """Motors and inputs of a brick, and the commands that work on them."""

    def __init__(self, body: Body) -> None:
        self.body = body
        self.motors = [Motor(output, body) for output in range(OUTPUTS)]
        self.inputs = Inputs(body, self.motors)

    def tick(self) -> None:
        """Let the moves go on."""
        for motor in self.motors:
            motor.tick()

    def chosen(self, nos: int) -> list[Motor]:
        """Motors of a bit field."""
        if not 0 <= nos < 1 << OUTPUTS:
            raise MachineError
        return [motor for k, motor in enumerate(self.motors) if nos >> k & 1]

    def single(self, number: int) -> Motor:
        """Motor of an index."""
        if not 0 <= number < OUTPUTS:
            raise MachineError
        return self.motors[number]


class Program:
    """One direct command at work."""

    def __init__(self, machine: Machine, request: Request) -> None:
        self.request = request
        self._machine = machine
        self._globals = bytearray(request.global_bytes)
        self._locals = bytearray(request.local_bytes)
        self._place = 0

    @property
    def values(self) -> bytes:
        """What goes into the reply."""
        return bytes(self._globals)

    def run(self) -> Waiting:
        """Carry it out; True: without an error."""
        done = 0
        try:
            while self._place < len(self.request.codes):
                instruction, self._place = decode_at(self.request.codes, self._place)
                if instruction.name == "OBJECT_END":
                    return True
                yield from self._carry_out(instruction)
                done += 1
                if done % LONGEST == 0:
                    yield
        except (MachineError, ProtocolError, struct.error, ZeroDivisionError):
            return False
        return True

    def _carry_out(self, instruction: Instruction) -> Generator[None, None, None]:
        name, given = instruction
        if name.startswith("OUTPUT_"):
            yield from self._output(name.removeprefix("OUTPUT_"), given)
        elif name.startswith("INPUT_"):
            yield from self._input(name.removeprefix("INPUT_"), given)
        elif name.startswith("TIMER_"):
            yield from self._timer(name, given)
        elif name.startswith(("JR", "CP_", "MOVE")):
            self._flow(name, given)
        elif name[:2] in ("AD", "SU", "MU", "DI", "OR", "AN", "XO", "MA"):
            self._calculate(name, given)
        else:
            self._tell(name, given)

    def _output(self, name: str, given: tuple[Argument, ...]) -> Generator[None, None, None]:
        machine, numbers = self._machine, [0 if isinstance(argument, str) else self._integer(argument) for argument in given]
        match name:
            case "GET_COUNT":
                self._store(given[2], machine.single(numbers[1]).count, "<i")
            case "READ":
                motor = machine.single(numbers[1])
                self._store(given[2], motor.speed, "<b")
                self._store(given[3], motor.limited_count, "<i")
            case "TEST":
                self._store(given[2], int(any(motor.move is not None for motor in machine.chosen(numbers[1]))), "<b")
            case "READY":
                while any(motor.move is not None for motor in machine.chosen(numbers[1])):
                    yield
            case "STEP_SYNC" | "TIME_SYNC":
                self._pair(name, numbers)
            case _:
                for motor in machine.chosen(numbers[1]):
                    _command(motor, name, numbers[2:])

    def _pair(self, name: str, numbers: list[int]) -> None:
        motors, (speed, turn, length, brake) = self._machine.chosen(numbers[1]), numbers[2:]
        if len(motors) != 2:
            raise MachineError
        timed = name == "TIME_SYNC"
        sign = -1 if length < 0 else 1
        parts = 0.0, abs(length) * (1e-3 if timed else 1.0), 0.0
        synchronise(motors[0], motors[1], turn, Move(sign * speed, parts, timed, bool(brake)))

    def _input(self, name: str, given: tuple[Argument, ...]) -> Generator[None, None, None]:
        inputs = self._machine.inputs
        if name.startswith("CLR"):
            return
        number = self._integer(given[1])
        if name == "GET_TYPEMODE":
            for place, value in zip(given[2:], inputs.identity(number), strict=True):
                self._store(place, value, "<b")
            return
        kind, mode = self._integer(given[2]), self._integer(given[3])
        places = given[5:] if name.startswith("READY") else given[4:]
        ready = inputs.choose(number, kind, mode)
        while name.startswith("READY") and not ready:
            yield
            ready = inputs.choose(number, kind, mode)
        layout = {"READY_SI": "<f", "READSI": "<f", "READY_RAW": "<i"}.get(name, "<b")
        for place, value in zip(places, inputs.values(number, kind, len(places)), strict=True):
            self._store(place, value, layout)

    def _timer(self, name: str, given: tuple[Argument, ...]) -> Generator[None, None, None]:
        now = self._machine.body.now
        if name == "TIMER_WAIT":
            self._store(given[1], int((now() * 1e3 + self._integer(given[0])) % 0x7FFFFFFF), "<i")
        elif name == "TIMER_READ":
            self._store(given[0], int(now() * 1e3 % 0x7FFFFFFF), "<i")
        else:
            while now() * 1e3 % 0x7FFFFFFF < self._integer(given[0]):
                yield

    def _flow(self, name: str, given: tuple[Argument, ...]) -> None:
        if name.startswith("MOVE"):
            source, target = name.removeprefix("MOVE").split("_")
            self._store(given[1], self._load(given[0], FORMATS[source]), FORMATS[target])
            return
        kind, _, what = name.partition("_")
        if kind == "CP":
            self._store(given[2], int(self._holds(what, given)), "<b")
        elif what == "" or self._holds(what, given):
            self._place += self._integer(given[-1])
            if not 0 <= self._place <= len(self.request.codes):
                raise MachineError

    def _holds(self, what: str, given: tuple[Argument, ...]) -> bool:
        if what in ("TRUE", "FALSE"):
            return bool(self._load(given[0], "<b")) == (what == "TRUE")
        width = next(width for width in WIDTHS if what.endswith(width))
        left, right = (self._load(argument, FORMATS[width]) for argument in given[:2])
        return _COMPARISONS[what.removesuffix(width)](left, right)

    def _calculate(self, name: str, given: tuple[Argument, ...]) -> None:
        if name == "MATH_ABS":
            self._store(given[1], abs(self._load(given[0], "<f")), "<f")
            return
        width = next(width for width in WIDTHS if name.endswith(width))
        left, right = (self._load(argument, FORMATS[width]) for argument in given[:2])
        self._store(given[2], _result(name.removesuffix(width), left, right, width), FORMATS[width])

    def _tell(self, name: str, given: tuple[Argument, ...]) -> None:
        match name:
            case "UI_READ_GET_VBATT" | "UI_READ_GET_IBATT" | "UI_READ_GET_LBATT":
                volts, amperes = self._machine.body.battery()
                level = round(min(max((volts - 7.1) / 0.4, 0.0), 1.0) * 100)
                value, layout = {"V": (volts, "<f"), "I": (amperes, "<f"), "L": (level, "<b")}[name[12]]
                self._store(given[0], value, layout)
            case "INFO_GET_VOLUME" | "INFO_GET_MINUTES":
                self._store(given[0], 30, "<b")
            case "MEMORY_USAGE":
                self._store(given[0], 6000, "<i")
                self._store(given[1], 5000, "<i")
            case "COM_GET_BRICKNAME":
                self._write(given, NAME)
            case "COM_GET_NETWORK":
                for place, text in zip(given[2:], NETWORK, strict=True):
                    self._write((given[1], place), text)
            case _ if name.endswith(("_VERS", "_BUILD")):
                self._write(given, VERSIONS[name.removeprefix("UI_READ_GET_").removesuffix("_VERS")])
            case _:  # LED, tone, NOP: nobody sees or hears them
                pass

    def _write(self, given: tuple[Argument, ...], text: str) -> None:
        size, place = self._integer(given[0]), given[1]
        if not isinstance(place, Variable):
            raise MachineError
        memory = self._memory(place, size)
        memory[place.offset : place.offset + size] = text.encode("ascii")[: size - 1].ljust(size, b"\0")

    def _integer(self, argument: Argument) -> int:
        if isinstance(argument, str):
            raise MachineError
        wide = not isinstance(argument, Variable) or self._fits(argument, 4)
        return int(self._load(argument, "<i" if wide else "<b"))

    def _fits(self, place: Variable, size: int) -> bool:
        return place.offset + size <= len(self._locals if place.local else self._globals)

    def _load(self, argument: Argument, layout: str) -> float:
        if isinstance(argument, str):
            raise MachineError
        if isinstance(argument, Variable):
            return struct.unpack_from(layout, self._memory(argument, struct.calcsize(layout)), argument.offset)[0]
        return argument

    def _store(self, place: Argument, value: float, layout: str) -> None:
        if not isinstance(place, Variable):
            raise MachineError
        if layout != "<f":
            value = NO_DATA[layout] if not math.isfinite(value) else _wrapped(round(value), struct.calcsize(layout))
        struct.pack_into(layout, self._memory(place, struct.calcsize(layout)), place.offset, value)

    def _memory(self, place: Variable, size: int) -> bytearray:
        if not self._fits(place, size):
            raise MachineError
        return self._locals if place.local else self._globals


_COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    "LT": operator.lt,
    "GT": operator.gt,
    "EQ": operator.eq,
    "NEQ": operator.ne,
    "LTEQ": operator.le,
    "GTEQ": operator.ge,
}


_LOGIC: dict[str, Callable[[int, int], int]] = {"OR": operator.or_, "AND": operator.and_, "XOR": operator.xor}
_ARITHMETIC: dict[str, Callable[[float, float], float]] = {"ADD": operator.add, "SUB": operator.sub, "MUL": operator.mul}


def _command(motor: Motor, name: str, numbers: list[int]) -> None:
    """An instruction for one motor."""
    if name.startswith(("STEP_", "TIME_")):
        percent, up, const, down, brake = numbers
        unit = 1e-3 if name.startswith("TIME") else 1.0
        percent = _wrapped(percent, 1)
        sign = -1 if up + const + down < 0 < percent else 1
        parts = abs(up) * unit, abs(const) * unit, abs(down) * unit
        motor.begin(Move(sign * percent, parts, name.startswith("TIME"), bool(brake)))
        return
    match name:
        case "STOP":
            motor.stop(brake=bool(numbers[0]))
        case "SPEED" | "POWER":
            motor.set_speed(_wrapped(numbers[0], 1))
        case "START":
            motor.start()
        case "POLARITY":
            motor.polarity = numbers[0] or -motor.polarity
        case "CLR_COUNT":
            motor.clear()
        case _:  # RESET clears the counter of moves with an end, which each of them clears too
            pass


def _result(operation: str, left: float, right: float, width: str) -> float:
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


def _wrapped(value: int, size: int) -> int:
    """The low bytes of an integer, as a signed number."""
    return int.from_bytes((value & (1 << 8 * size) - 1).to_bytes(size, "little"), "little", signed=True)
