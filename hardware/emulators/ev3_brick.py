"""The EV3 as its client sees it: direct commands over a stream, with the firmware's quirks."""

from __future__ import annotations

import socket
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress

from hardware.emulators.ev3_machine import Body, Machine, Program, Waiting
from hardware.protocols import ev3_direct
from hardware.protocols.errors import ProtocolError
from hardware.protocols.ev3_direct import Beacon, Messages, Reply, Request

BEACON_PERIOD = 5.0
"""[s]"""


class Ev3Brick:
    """A `Device`: one direct command runs at a time; what it is built into goes on when the client is gone.

    While a command that wants a reply runs, others are dropped without a word; while one that wants none runs, they are refused.
    Nothing stops the motors when the link dies.
    """

    def __init__(self, body: Body, *, wifi: bool = True, delay: Callable[[], float] = lambda: 0.0) -> None:
        """Switch it on.

        Args:
            body: what it is built into.
            wifi: a client must unlock it first.
            delay: draws the time from request to reply [s]; half of it passes before the command is carried out.
        """
        self.machine = Machine(body)
        self._body = body
        self._wifi = wifi
        self._delay = delay
        self._locked = wifi
        self._messages = Messages()
        self._arrived: deque[tuple[float, float, bytes]] = deque()
        self._replies: deque[tuple[float, bytes]] = deque()
        self._program: tuple[Program, Waiting, float] | None = None

    def attach(self) -> None:
        """A client has come; what the one before had asked is not answered any more."""
        self._locked, self._messages = self._wifi, Messages()
        self._arrived.clear()
        self._replies.clear()

    def tick(self) -> None:
        """See `Device`: moves and the running command go on, with a client or without."""
        self.machine.tick()
        self._go_on()

    def exchange(self, received: bytes) -> bytes:
        """See `Device`."""
        said = b""
        if received and self._locked:
            if not ev3_direct.is_unlock(received):
                return b""
            self._locked, received, said = False, b"", ev3_direct.UNLOCKED
        self._listen(received)
        now = self._body.now()
        while self._arrived and self._arrived[0][0] <= now:
            _, delay, message = self._arrived.popleft()
            self._begin(message, delay)
            self._go_on()
        self._go_on()
        while self._replies and self._replies[0][0] <= self._body.now():
            said += self._replies.popleft()[1]
        return said

    def _listen(self, received: bytes) -> None:
        try:
            messages = self._messages.feed(received)
        except ProtocolError:
            return
        now = self._body.now()
        for message in messages:
            delay = self._delay()
            self._arrived.append((now + 0.5 * delay, delay, message))

    def _begin(self, message: bytes, delay: float) -> None:
        try:
            request = ev3_direct.parse_request(message)
        except ProtocolError:
            self._reply(Reply(int.from_bytes(message[2:4], "little"), ok=False), delay)
            return
        if self._program is not None:
            if not self._program[0].request.wants_reply:
                self._refuse(request, delay)
            return
        program = Program(self.machine, request)
        self._program = program, program.run(), delay

    def _go_on(self) -> None:
        """Let the command run until it waits or ends."""
        if self._program is None:
            return
        program, waiting, delay = self._program
        try:
            next(waiting)
        except StopIteration as end:
            self._program = None
            if program.request.wants_reply:
                self._reply(Reply(program.request.counter, program.values, bool(end.value)), delay)

    def _refuse(self, request: Request, delay: float) -> None:
        if request.wants_reply:
            self._reply(Reply(request.counter, ok=False), delay)

    def _reply(self, reply: Reply, delay: float) -> None:
        self._replies.append((self._body.now() + 0.5 * delay, reply.pack()))


class BeaconSender:
    """Tells everybody by UDP that the brick is there, every `period` [s], from `open` to `close`."""

    def __init__(self, beacon: Beacon, host: str = "127.0.0.1", period: float = BEACON_PERIOD) -> None:
        self._beacon = beacon
        self._to = (host, ev3_direct.BEACON_PORT)
        self._period = period
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    def open(self) -> None:
        """Begin."""
        self._thread = threading.Thread(target=self._send, name="beacon", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End. May be called twice."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join()

    def _send(self) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            while True:
                with suppress(OSError):  # nobody listens
                    sender.sendto(self._beacon.pack(), self._to)
                if self._ended.wait(self._period):
                    return
