"""A brick with ev3dev: its server, the very script that runs on the brick, in a process of its own on a kernel's files."""

from __future__ import annotations

import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

from hardware.drivers import ev3dev_server
from hardware.emulators.errors import EmulatorError
from hardware.emulators.ev3dev_tree import Body, Ev3devTree
from hardware.openable import Openable


class Ev3devBrick(Openable):
    """Serves a body from `open` to `close`."""

    def __init__(self, body: Body, host: str = "127.0.0.1", port: int = 0) -> None:
        """Switch it on.

        Args:
            body: what it is built into.
            host: where the server listens.
            port: 0 is any that is free.
        """
        self._body = body
        self._place = (host, port)
        self._held = ExitStack()

    @property
    def address(self) -> str:
        """`ev3dev:HOST:PORT`, what a driver connects to; known after `open`."""
        return f"ev3dev:{self._place[0]}:{self._place[1]}"

    def open(self) -> None:
        """Make the files, start the server.

        Raises:
            EmulatorError: it cannot serve there.
        """
        with ExitStack() as held:
            root = Path(held.enter_context(TemporaryDirectory(prefix="ev3dev"))) / "class"
            held.enter_context(Ev3devTree(self._body, root))
            server = _start(root, *self._place)
            held.callback(_end, server)
            assert server.stdout is not None
            said = server.stdout.readline()
            if not said:
                problem = server.communicate()[1].strip().rpartition("\n")[2]
                raise EmulatorError(f"no brick with ev3dev at {self.address}: {problem}; choose another port")
            self._place = (self._place[0], int(said.rpartition(":")[2]))
            self._held = held.pop_all()

    def close(self) -> None:
        """End the server and let go of the body. May be called twice."""
        self._held.close()


def _start(root: Path, host: str, port: int) -> subprocess.Popen[str]:
    command = [sys.executable, "-S", str(ev3dev_server.__file__), "--root", str(root), "--host", host, "--port", str(port)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def _end(server: subprocess.Popen[str]) -> None:
    server.kill()
    server.communicate()
