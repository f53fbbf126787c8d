"""A device that passes everything on to another one, so that the faults of `port.Port` can befall what has no port of its own."""

from __future__ import annotations

from contextlib import suppress

from hardware.drivers.errors import LinkError
from hardware.drivers.transport import TcpTransport

LISTENING = 0.001
"""[s]"""


class Relay:
    """A `Device` of `hardware.emulators.port`: stands between a client and a server that is reached by TCP."""

    def __init__(self, host: str, port: int) -> None:
        self._place = (host, port)
        self._way: TcpTransport | None = None

    def attach(self) -> None:
        """See `Device`: every client gets a connection of its own."""
        self.close()
        with suppress(LinkError):
            self._way = TcpTransport(*self._place)

    def tick(self) -> None:
        """See `Device`."""

    def exchange(self, received: bytes) -> bytes:
        """See `Device`; a server that is gone says nothing."""
        if self._way is None:
            return b""
        try:
            if received:
                self._way.write(received)
            return self._way.read(LISTENING)
        except LinkError:
            self.close()
            return b""

    def close(self) -> None:
        """Let go of the server. May be called twice."""
        if self._way is not None:
            self._way.close()
        self._way = None
