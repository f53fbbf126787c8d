"""The EV3's virtual machine: carries out the byte codes of a direct command (lms2012)."""

from __future__ import annotations

import struct
from collections.abc import Generator
from typing import Protocol

from hardware.emulators.ev3_arithmetic import COMPARISONS, result, wrapped
from hardware.emulators.ev3_memory import FORMATS, MachineError, Memory
from hardware.emulators.ev3_motors import Chassis, Motor, Move, synchronise
from hardware.emulators.ev3_sensors import Inputs, Sensing
from hardware.protocols.errors import ProtocolError
from hardware.protocols.ev3_codes import WIDTHS, Argument, Instruction, decode_at
from hardware.protocols.ev3_direct import Request

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
        self._memory = Memory(request.global_bytes, request.local_bytes)
        self._place = 0

    @property
    def values(self) -> bytes:
        """What goes into the reply."""
        return self._memory.values

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
        machine, numbers = self._machine, [0 if isinstance(argument, str) else self._memory.integer(argument) for argument in given]
        match name:
            case "GET_COUNT":
                self._memory.store(given[2], machine.single(numbers[1]).count, "<i")
            case "READ":
                motor = machine.single(numbers[1])
                self._memory.store(given[2], motor.speed, "<b")
                self._memory.store(given[3], motor.limited_count, "<i")
            case "TEST":
                self._memory.store(given[2], int(any(motor.move is not None for motor in machine.chosen(numbers[1]))), "<b")
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
        number = self._memory.integer(given[1])
        if name == "GET_TYPEMODE":
            for place, value in zip(given[2:], inputs.identity(number), strict=True):
                self._memory.store(place, value, "<b")
            return
        kind, mode = self._memory.integer(given[2]), self._memory.integer(given[3])
        places = given[5:] if name.startswith("READY") else given[4:]
        ready = inputs.choose(number, kind, mode)
        while name.startswith("READY") and not ready:
            yield
            ready = inputs.choose(number, kind, mode)
        layout = {"READY_SI": "<f", "READSI": "<f", "READY_RAW": "<i"}.get(name, "<b")
        for place, value in zip(places, inputs.values(number, kind, len(places)), strict=True):
            self._memory.store(place, value, layout)

    def _timer(self, name: str, given: tuple[Argument, ...]) -> Generator[None, None, None]:
        now = self._machine.body.now
        if name == "TIMER_WAIT":
            self._memory.store(given[1], int((now() * 1e3 + self._memory.integer(given[0])) % 0x7FFFFFFF), "<i")
        elif name == "TIMER_READ":
            self._memory.store(given[0], int(now() * 1e3 % 0x7FFFFFFF), "<i")
        else:
            while now() * 1e3 % 0x7FFFFFFF < self._memory.integer(given[0]):
                yield

    def _flow(self, name: str, given: tuple[Argument, ...]) -> None:
        if name.startswith("MOVE"):
            source, target = name.removeprefix("MOVE").split("_")
            self._memory.store(given[1], self._memory.load(given[0], FORMATS[source]), FORMATS[target])
            return
        kind, _, what = name.partition("_")
        if kind == "CP":
            self._memory.store(given[2], int(self._holds(what, given)), "<b")
        elif what == "" or self._holds(what, given):
            self._place += self._memory.integer(given[-1])
            if not 0 <= self._place <= len(self.request.codes):
                raise MachineError

    def _holds(self, what: str, given: tuple[Argument, ...]) -> bool:
        if what in ("TRUE", "FALSE"):
            return bool(self._memory.load(given[0], "<b")) == (what == "TRUE")
        width = next(width for width in WIDTHS if what.endswith(width))
        left, right = (self._memory.load(argument, FORMATS[width]) for argument in given[:2])
        return COMPARISONS[what.removesuffix(width)](left, right)

    def _calculate(self, name: str, given: tuple[Argument, ...]) -> None:
        if name == "MATH_ABS":
            self._memory.store(given[1], abs(self._memory.load(given[0], "<f")), "<f")
            return
        width = next(width for width in WIDTHS if name.endswith(width))
        left, right = (self._memory.load(argument, FORMATS[width]) for argument in given[:2])
        self._memory.store(given[2], result(name.removesuffix(width), left, right, width), FORMATS[width])

    def _tell(self, name: str, given: tuple[Argument, ...]) -> None:
        match name:
            case "UI_READ_GET_VBATT" | "UI_READ_GET_IBATT" | "UI_READ_GET_LBATT":
                volts, amperes = self._machine.body.battery()
                level = round(min(max((volts - 7.1) / 0.4, 0.0), 1.0) * 100)
                value, layout = {"V": (volts, "<f"), "I": (amperes, "<f"), "L": (level, "<b")}[name[12]]
                self._memory.store(given[0], value, layout)
            case "INFO_GET_VOLUME" | "INFO_GET_MINUTES":
                self._memory.store(given[0], 30, "<b")
            case "MEMORY_USAGE":
                self._memory.store(given[0], 6000, "<i")
                self._memory.store(given[1], 5000, "<i")
            case "COM_GET_BRICKNAME":
                self._memory.write(given, NAME)
            case "COM_GET_NETWORK":
                for place, text in zip(given[2:], NETWORK, strict=True):
                    self._memory.write((given[1], place), text)
            case _ if name.endswith(("_VERS", "_BUILD")):
                self._memory.write(given, VERSIONS[name.removeprefix("UI_READ_GET_").removesuffix("_VERS")])
            case _:  # LED, tone, NOP: nobody sees or hears them
                pass


def _command(motor: Motor, name: str, numbers: list[int]) -> None:
    """An instruction for one motor."""
    if name.startswith(("STEP_", "TIME_")):
        percent, up, const, down, brake = numbers
        unit = 1e-3 if name.startswith("TIME") else 1.0
        percent = wrapped(percent, 1)
        sign = -1 if up + const + down < 0 < percent else 1
        parts = abs(up) * unit, abs(const) * unit, abs(down) * unit
        motor.begin(Move(sign * percent, parts, name.startswith("TIME"), bool(brake)))
        return
    match name:
        case "STOP":
            motor.stop(brake=bool(numbers[0]))
        case "SPEED" | "POWER":
            motor.set_speed(wrapped(numbers[0], 1))
        case "START":
            motor.start()
        case "POLARITY":
            motor.polarity = numbers[0] or -motor.polarity
        case "CLR_COUNT":
            motor.clear()
        case _:  # RESET clears the counter of moves with an end, which each of them clears too
            pass
