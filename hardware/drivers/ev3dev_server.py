"""Runs on a brick with ev3dev, on its stock Python 3.5 and nothing else: wheel speeds in, counters, gyro and battery out, over TCP.

One line asks, one line answers, in the units of the brick:

    ports A D 4         ->  ok *DA                                 wheels' outputs (left, right), the gyro's input or 0
    -120 240            ->  COUNT COUNT RATE MICROVOLT MICROSECOND *SUM     [deg/s] of both wheels; counters [deg], gyro [deg/s, or "none"]

An answer ends with the sum of the bytes before its star, modulo 256, as two hex digits: of half a number nothing else would tell.

When nothing has been asked for SILENCE the wheels slow down and brake by themselves, whether the line is whole or not.
The newest client is the one that is listened to.
"""

import argparse
import os
import select
import socket
import sys
import time

SILENCE = 0.1
"""[s]"""
SLOWING_DEG = 1833.0
"""How fast wheels slow down by themselves [deg/s^2]: from full speed in half a second; much faster tips the robot over."""
TICK = 0.01
"""Longest time between two looks at the clock [s]."""
PORT = 5556


class Attribute:
    """A file of the kernel's that holds one value."""

    def __init__(self, path: str, write: bool = False) -> None:
        self._file = os.open(path, os.O_RDWR if write else os.O_RDONLY)

    def read(self) -> str:
        """The value as text."""
        return os.pread(self._file, 64, 0).decode().split("\n")[0].strip()

    def write(self, value: str) -> None:
        """Set it."""
        os.pwrite(self._file, (value + "\n").encode(), 0)


def find(root: str, kind: str, address: str) -> str:
    """The folder of the device at a port.

    Raises:
        OSError: nothing is plugged in there.
    """
    folder = os.path.join(root, kind)
    for name in sorted(os.listdir(folder)) if os.path.isdir(folder) else []:
        path = os.path.join(folder, name)
        if Attribute(os.path.join(path, "address")).read() == address:
            return path
    raise OSError("nothing is plugged into %s" % address)


class Motor:
    """A large motor under the kernel's speed regulator."""

    def __init__(self, root: str, output: str) -> None:
        path = find(root, "tacho-motor", "ev3-ports:out" + output)
        if Attribute(os.path.join(path, "driver_name")).read() != "lego-ev3-l-motor":
            raise OSError("output %s has no large motor" % output)
        self._position = Attribute(os.path.join(path, "position"))
        self._speed = Attribute(os.path.join(path, "speed_sp"), write=True)
        self._command = Attribute(os.path.join(path, "command"), write=True)
        Attribute(os.path.join(path, "stop_action"), write=True).write("brake")
        self.run(0)

    def run(self, speed_deg: int) -> None:
        """Turn at a speed [deg/s]; 0 brakes."""
        if speed_deg:
            self._speed.write(str(speed_deg))
        self._command.write("run-forever" if speed_deg else "stop")

    def count(self) -> int:
        """Position [deg]."""
        return int(self._position.read())


class Gyro:
    """The gyro in its mode for rates; without one there are none."""

    def __init__(self, root: str, number: int) -> None:
        self._value = None
        if not number:
            return
        path = find(root, "lego-sensor", "ev3-ports:in%d" % number)
        if Attribute(os.path.join(path, "driver_name")).read() != "lego-ev3-gyro":
            raise OSError("input %d has no gyro" % number)
        mode = Attribute(os.path.join(path, "mode"), write=True)
        if mode.read() != "GYRO-RATE":
            mode.write("GYRO-RATE")
        self._value = Attribute(os.path.join(path, "value0"))

    def rate(self) -> str:
        """The rate [deg/s], clockwise, as text."""
        return self._value.read() if self._value else "none"


class Brick:
    """Wheels, gyro and battery; without a client the wheels stand."""

    def __init__(self, root: str) -> None:
        self._root = root
        self._motors = self._no_motors()
        self._gyro = Gyro(root, 0)
        self._volts = Attribute(os.path.join(find_battery(root), "voltage_now"))
        self._speeds = [0, 0]
        self._asked = self._slowed = time.monotonic()

    def _no_motors(self) -> "list[Motor]":
        return []

    def answer(self, line: str) -> str:
        """Do what a line says; returns the line that answers."""
        words = line.split()
        try:
            if len(words) == 4 and words[0] == "ports":
                return self._take(words[1], words[2], int(words[3]))
            if len(words) == 2 and self._motors:
                return self._drive([int(word) for word in words])
        except (OSError, ValueError) as error:
            return "error %s" % error
        return "error '%s' is not understood" % line[:40]

    def watch(self) -> None:
        """Slow down when nobody has asked for a while."""
        now = time.monotonic()
        if any(self._speeds) and now - self._asked > SILENCE:
            change = SLOWING_DEG * (now - max(self._slowed, self._asked + SILENCE))
            fastest = max(abs(speed) for speed in self._speeds)
            share = max(fastest - change, 0.0) / fastest
            self._run([int(speed * share) for speed in self._speeds])
        self._slowed = now

    def stop(self) -> None:
        """Brake."""
        self._run([0 for _ in self._motors])

    def _take(self, left: str, right: str, gyro: int) -> str:
        motors = [Motor(self._root, left), Motor(self._root, right)]
        self._gyro = Gyro(self._root, gyro)
        self._motors, self._speeds = motors, [0, 0]
        return "ok"

    def _drive(self, speeds_deg: "list[int]") -> str:
        self._asked = time.monotonic()
        if speeds_deg != self._speeds:
            self._run(speeds_deg)
        counts = [motor.count() for motor in self._motors]
        now_us = int(1e6 * time.monotonic())
        return "%d %d %s %s %d" % (counts[0], counts[1], self._gyro.rate(), self._volts.read(), now_us)

    def _run(self, speeds_deg: "list[int]") -> None:
        self._speeds = speeds_deg
        for motor, speed_deg in zip(self._motors, speeds_deg):
            motor.run(speed_deg)


def summed(answer: str) -> bytes:
    """A line with its sum."""
    said = answer.encode("ascii", "replace")
    return said + b" *%02X\n" % (sum(said) % 256)


def find_battery(root: str) -> str:
    """The folder of the brick's battery."""
    return os.path.join(root, "power_supply", "lego-ev3-battery")


class Client:
    """Who asks."""

    def __init__(self, link: socket.socket) -> None:
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        link.settimeout(1.0)
        self.link = link
        self._pending = b""

    def listen(self, brick: Brick) -> bool:
        """Answer what has come; whether the client is still there."""
        try:
            received = self.link.recv(4096)
            lines = (self._pending + received).split(b"\n")
            self._pending = lines.pop()
            for line in lines:
                self.link.sendall(summed(brick.answer(line.decode("ascii", "replace"))))
        except OSError:
            return False
        return bool(received) and len(self._pending) <= 4096


def serve(brick: Brick, listener: socket.socket) -> None:
    """Answer clients, for ever."""
    clients = [Client(listener.accept()[0])]
    while True:
        brick.watch()
        ready = select.select([listener] + [client.link for client in clients], [], [], TICK)[0]
        if listener in ready:
            for client in clients:
                client.link.close()
            clients = [Client(listener.accept()[0])]
        elif ready and clients and not clients[0].listen(brick):
            clients.pop().link.close()


def main() -> int:
    """Serve until killed."""
    parser = argparse.ArgumentParser(description="Wheels, gyro and battery of an EV3 with ev3dev, over TCP.")
    parser.add_argument("--host", default="0.0.0.0")
    parser.add_argument("--port", type=int, default=PORT)
    parser.add_argument("--root", default="/sys/class", help="where the kernel shows its devices")
    arguments = parser.parse_args()
    brick = Brick(arguments.root)
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listener.bind((arguments.host, arguments.port))
    listener.listen(2)
    sys.stdout.write("brick at %s:%d\n" % listener.getsockname())
    sys.stdout.flush()
    try:
        serve(brick, listener)
    finally:
        brick.stop()
    return 0


if __name__ == "__main__":
    sys.exit(main())
