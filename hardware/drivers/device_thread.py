"""The one thread of a device: works with it, and finds it again when the link breaks."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Protocol

from hardware.errors import HardwareError

_log = logging.getLogger(__name__)
FIRST_WAIT, LONGEST_WAIT = 0.1, 0.4
"""Before the first attempt to find a device again, and the longest one [s]; it doubles from one to the other."""


class Session(Protocol):
    """A device, connected."""

    def step(self) -> None:
        """Work with it for up to a tenth of a second.

        Raises:
            HardwareError: the link is broken.
        """
        ...

    def close(self) -> None:
        """Leave it at rest, when it still listens, and let go."""
        ...


class DeviceThread:
    """Works from `open` to `close` on one session after the other."""

    def __init__(self, name: str, connect: Callable[[], Session]) -> None:
        self._name = name
        self._connect = connect
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None
        self.link = False
        """The device answers."""
        self.losses = 0
        """How often it stopped to."""

    def open(self) -> None:
        """Connect and begin.

        Raises:
            HardwareError: the device cannot be used; nothing is held.
        """
        session = self._connect()
        self._ended.clear()
        self.link = True
        self._thread = threading.Thread(target=self._run, args=(session,), name=self._name, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End, with the device at rest. May be called twice."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join()
        self._thread, self.link = None, False

    def _run(self, session: Session | None) -> None:
        while session is not None and not self._ended.is_set():
            try:
                session.step()
            except HardwareError as error:
                self.link = False
                self.losses += 1
                _log.warning("%s; trying to find it again", error)
                session.close()
                session = self._reconnected()
        if session is not None:
            session.close()

    def _reconnected(self) -> Session | None:
        """The device, found again; None when it is not needed any more."""
        wait = FIRST_WAIT
        while not self._ended.wait(wait):
            try:
                session = self._connect()
            except HardwareError:
                wait = min(2.0 * wait, LONGEST_WAIT)
                continue
            self.link = True
            _log.warning("%s is back", self._name)
            return session
        return None


class DeviceDriver:
    """What all drivers tell of the thread that works for them."""

    def __init__(self, thread: DeviceThread) -> None:
        self._thread = thread

    @property
    def link(self) -> bool:
        """Whether the device answers."""
        return self._thread.link

    @property
    def losses(self) -> int:
        """How often it stopped to answer."""
        return self._thread.losses
