"""The emulated end of a wire: a TCP port or a pseudo-terminal. One client at a time."""

from __future__ import annotations

import os
import pty
import select
import socket
import tty
from contextlib import suppress
from pathlib import Path
from typing import Protocol

from hardware.emulators.errors import EmulatorError

CHUNK = 4096
"""Most bytes that are taken at once."""


class Channel(Protocol):
    """A wire to clients."""

    address: str
    """What a client connects to."""
    clients: int
    """Clients so far; 0 before the first one."""
    connected: bool

    def open(self) -> None:
        """Be there.

        Raises:
            EmulatorError: the port is taken.
        """
        ...

    def receive(self, timeout: float) -> bytes:
        """What a client has sent; nothing after `timeout` [s]. Lets clients in and out."""
        ...

    def send(self, message: bytes) -> None:
        """Say something to the client; what nobody takes is lost, as on the real wire."""
        ...

    def close(self) -> None:
        """Be gone, for the client too. May be called twice."""
        ...


class TcpChannel:
    """A TCP port of this machine."""

    def __init__(self, host: str = "127.0.0.1", port: int = 0) -> None:
        self._place = (host, port)
        self._listener: socket.socket | None = None
        self._client: socket.socket | None = None
        self.clients = 0

    @property
    def address(self) -> str:
        """`tcp:HOST:PORT`."""
        return f"tcp:{self._place[0]}:{self._place[1]}"

    @property
    def connected(self) -> bool:
        """Whether a client is there."""
        return self._client is not None

    def open(self) -> None:
        """See `Channel`."""
        try:
            self._listener = socket.create_server(self._place, backlog=1)
        except OSError as error:
            raise EmulatorError(f"cannot listen on {self._place[0]}:{self._place[1]}: {error.strerror}; choose another port") from error
        self._place = (self._place[0], int(self._listener.getsockname()[1]))  # also after an unplug it is the same one

    def receive(self, timeout: float) -> bytes:
        """See `Channel`."""
        waiting = self._client or self._listener
        if waiting is None or not select.select([waiting], [], [], timeout)[0]:
            return b""
        if self._client is None:
            return self._accept()
        try:
            received = self._client.recv(CHUNK)
        except OSError:
            received = b""
        if not received:
            self._hang_up()
        return received

    def send(self, message: bytes) -> None:
        """See `Channel`."""
        if self._client is None:
            return
        try:
            self._client.sendall(message)
        except OSError:
            self._hang_up()

    def close(self) -> None:
        """See `Channel`."""
        self._hang_up()
        if self._listener is not None:
            self._listener.close()
        self._listener = None

    def _accept(self) -> bytes:
        if self._listener is not None:
            self._client, _ = self._listener.accept()
            self._client.settimeout(1.0)
            self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.clients += 1
        return b""

    def _hang_up(self) -> None:
        if self._client is not None:
            self._client.close()
        self._client = None


class PtyChannel:
    """A pseudo-terminal under a name that stays, as udev gives one to a serial device."""

    def __init__(self, link: Path) -> None:
        self._link = link
        self._master: int | None = None
        self.clients = 0
        self.connected = False

    @property
    def address(self) -> str:
        """Path of the terminal."""
        return str(self._link)

    def open(self) -> None:
        """See `Channel`."""
        self._master, slave = pty.openpty()
        tty.setraw(slave)
        name = os.ttyname(slave)
        os.close(slave)
        os.set_blocking(self._master, False)
        try:
            if self._link.is_symlink():
                self._link.unlink()
            self._link.symlink_to(name)
        except OSError as error:
            self.close()
            raise EmulatorError(f"cannot make {self._link}: {error.strerror}; choose another path") from error

    def receive(self, timeout: float) -> bytes:
        """See `Channel`."""
        if self._master is None:
            return b""
        poller = select.poll()
        poller.register(self._master, select.POLLIN)
        events = poller.poll(timeout * 1e3)
        hung_up = bool(events) and bool(events[0][1] & select.POLLHUP)
        if not hung_up and not self.connected:
            self.clients += 1
        self.connected = not hung_up
        if hung_up:
            select.select([], [], [], timeout)  # poll answers at once while nobody has the terminal open
            return b""
        return self._read() if events else b""

    def send(self, message: bytes) -> None:
        """See `Channel`."""
        if self._master is not None:
            with suppress(OSError):
                os.write(self._master, message)

    def close(self) -> None:
        """See `Channel`."""
        if self._master is None:
            return
        os.close(self._master)
        self._master, self.connected = None, False
        with suppress(OSError):
            self._link.unlink()

    def _read(self) -> bytes:
        try:
            return os.read(self._master or 0, CHUNK)
        except OSError:
            return b""
