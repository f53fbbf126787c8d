"""The files in which a kernel with ev3dev shows motors, gyro and battery, as plain files of a folder.

Plain files know their values, not when they were written: a command that is written twice is one, as the server's writes allow.
"""

from __future__ import annotations

import math
import threading
from pathlib import Path
from typing import Protocol

from hardware.emulators.ev3_motors import Chassis
from hardware.emulators.ev3_sensors import Sensing
from hardware.openable import Openable
from hardware.protocols import ev3_direct

BEAT = 0.002
"""Between two looks at the files [s]."""
MICRO = 1e6


class Body(Chassis, Sensing, Protocol):
    """What the brick is built into."""

    def battery(self) -> tuple[float, float]:
        """Volts and amperes."""
        ...


class Ev3devTree(Openable):
    """Keeps a folder up to date from `open` to `close`, and the body at what the server writes."""

    def __init__(self, body: Body, root: Path) -> None:
        self._body = body
        self._root = root
        self._motors = {output: root / "tacho-motor" / f"motor{k}" for k, output in enumerate(body.motors())}
        self._gyros = {
            number: root / "lego-sensor" / f"sensor{number}" for number, kind in body.sensors().items() if kind == ev3_direct.GYRO
        }
        self._battery = root / "power_supply" / "lego-ev3-battery"
        self._speeds_deg: dict[int, float] = {}
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._follow, name="ev3dev", daemon=True)

    def open(self) -> None:
        """Make the files."""
        for output, folder in self._motors.items():
            _make(
                folder,
                address=f"ev3-ports:out{chr(ord('A') + output)}",
                driver_name="lego-ev3-l-motor",
                command="",
                speed_sp="0",
                stop_action="coast",
            )
        for number, folder in self._gyros.items():
            _make(folder, address=f"ev3-ports:in{number + 1}", driver_name="lego-ev3-gyro", mode="GYRO-ANG")
        _make(self._battery)
        self._report()
        self._thread.start()

    def close(self) -> None:
        """Let go. May be called twice."""
        self._ended.set()
        if self._thread.is_alive():
            self._thread.join()

    def _follow(self) -> None:
        while not self._ended.wait(BEAT):
            for output, folder in self._motors.items():
                self._obey(output, folder)
            self._report()

    def _obey(self, output: int, folder: Path) -> None:
        runs = _read(folder / "command").startswith("run-forever")
        speed_deg = _number(_read(folder / "speed_sp")) if runs else 0.0
        if speed_deg != self._speeds_deg.get(output, 0.0):
            self._speeds_deg[output] = speed_deg
            self._body.turn(output, speed_deg / ev3_direct.PERCENT_DEG)

    def _report(self) -> None:
        for output, folder in self._motors.items():
            _write(folder / "position", math.floor(self._body.angle_deg(output) + 0.5))
        for number, folder in self._gyros.items():
            mode = ev3_direct.GYRO_RATE if _read(folder / "mode") == "GYRO-RATE" else ev3_direct.GYRO_ANGLE
            _write(folder / "value0", round(self._body.sense(number, mode)[0]))
        _write(self._battery / "voltage_now", round(MICRO * self._body.battery()[0]))


def _make(folder: Path, **files: str) -> None:
    folder.mkdir(parents=True)
    for name, text in files.items():
        (folder / name).write_text(f"{text}\n", encoding="ascii")


def _read(file: Path) -> str:
    return file.read_text(encoding="ascii").partition("\n")[0].strip()


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:  # read in the middle of being written
        return 0.0


def _write(file: Path, value: int) -> None:
    """In place and always of one length: the server keeps the file open."""
    with file.open("r+b" if file.exists() else "wb", buffering=0) as opened:
        opened.write(b"%-16d\n" % value)
