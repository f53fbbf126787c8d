"""An emulated device on its wire, in a thread of its own; the wire can be cut, silenced and disturbed."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Protocol

from hardware.emulators.channels import Channel
from hardware.openable import Openable

_log = logging.getLogger(__name__)
TICK = 0.002
"""Longest time between two looks at the device [s]."""


class Device(Protocol):
    """What speaks at the far end of a wire."""

    def attach(self) -> None:
        """A client has come."""
        ...

    def tick(self) -> None:
        """Time has passed; called about every `TICK`, whether a client is there or not."""
        ...

    def exchange(self, received: bytes) -> bytes:
        """Take what the client says, also nothing, and give what is to be said now; called after each `tick` while a client is there."""
        ...


class Port(Openable):
    """Serves a device on a channel from `open` to `close`."""

    def __init__(self, device: Device, channel: Channel) -> None:
        self._device = device
        self._channel = channel
        self._thread: threading.Thread | None = None
        self._ended = threading.Event()
        self._plugged = threading.Event()
        self.silent = False
        """The device hears nothing and says nothing, and the wire is whole."""
        self.disturbed: Callable[[bytes], bytes] = bytes
        """What becomes of the device's messages on the way."""

    @property
    def address(self) -> str:
        """What a client connects to; known after `open`."""
        return self._channel.address

    @property
    def connected(self) -> bool:
        """Whether a client is there."""
        return self._channel.connected

    def open(self) -> None:
        """Plug the device in.

        Raises:
            EmulatorError: the wire cannot be had.
        """
        self._channel.open()
        self._plugged.set()
        self._thread = threading.Thread(target=self._serve, name=f"emulated {self.address}", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Unplug it for good. May be called twice."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join()
        self._channel.close()

    def unplug(self) -> None:
        """Pull the plug; the client's end of the wire breaks."""
        self._plugged.clear()

    def replug(self) -> None:
        """Put it back."""
        self._plugged.set()

    def _serve(self) -> None:
        known, whole = 0, True
        while not self._ended.is_set():
            self._device.tick()
            if not self._plugged.is_set():
                if whole:
                    self._channel.close()
                whole = False
                self._ended.wait(10 * TICK)
                continue
            if not whole:
                self._channel.open()
                whole = True
            received = self._channel.receive(TICK)
            if not self._channel.connected:
                known = 0
                continue
            if self._channel.clients != known:
                known = self._channel.clients
                self._device.attach()
            self._pass(received)

    def _pass(self, received: bytes) -> None:
        answer = self._device.exchange(b"" if self.silent else received)
        if answer and not self.silent:
            self._channel.send(self.disturbed(answer))
