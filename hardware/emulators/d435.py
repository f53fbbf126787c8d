"""The Intel RealSense D435 as its emulator's feeder sees it: what the camera is, its images, its time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hardware.camera_spec import CameraSpec, Imager
from hardware.protocols import camera_frames
from hardware.protocols.camera_frames import Hello, Kind, Lens, Messages, Pair
from hardware.protocols.errors import ProtocolError
from slam.messages import RgbdImage

SERIAL = "000000000000"
DEPTH_UNIT = 0.001
"""As the D435 leaves the factory [m]."""
DEEPEST = 0xFFFF
READOUT = 0.008
"""From the middle of the exposure to the begin of the transfer, which the camera's stamps tell of [s]."""


class D435:
    """A `Device` of `hardware.emulators.port` that sends the images of a source."""

    def __init__(self, source: Callable[[], RgbdImage | None], clock: Callable[[], float], spec: CameraSpec, zero: float = 4321.0) -> None:
        """Power on.

        Args:
            source: the next image in order; None: there is none.
            clock: the time of the images' stamps [s].
            spec: what the camera is.
            zero: what the camera's own clock says at time 0 [s].
        """
        self._source = source
        self._clock = clock
        self._spec = spec
        self._zero = zero
        self._messages = Messages()
        self._number = 0
        self._greeted = False

    def attach(self) -> None:
        """See `Device`."""
        self._messages, self._greeted = Messages(), False

    def tick(self) -> None:
        """See `Device`: the source goes by itself."""

    def exchange(self, received: bytes) -> bytes:
        """See `Device`."""
        said = [] if self._greeted else [camera_frames.pack_hello(hello(self._spec))]
        self._greeted = True
        said += self._times(received)
        image = self._source()
        if image is not None:
            self._number += 1
            said.append(camera_frames.pack_pair(self._pair(image)))
        return b"".join(said)

    def _times(self, received: bytes) -> list[bytes]:
        try:
            asked = [camera_frames.parse_time(body) for kind, body in self._messages.feed(received) if kind == Kind.TIME]
        except ProtocolError:  # a client that says what is no question
            self._messages = Messages()
            return []
        return [camera_frames.pack_time(number, self._time_us(self._clock())) for number, _ in asked]

    def _pair(self, image: RgbdImage) -> Pair:
        middle_us = self._time_us(image.stamp)
        return Pair(self._number, middle_us, middle_us + round(1e6 * READOUT), image.colour, depth_steps(image.depth))

    def _time_us(self, t: float) -> int:
        return round(1e6 * (self._zero + t))


def depth_steps(depth: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Depths of (H, W) [m] in steps of `DEPTH_UNIT`, as the camera sends them; 0 where there is none."""
    return np.nan_to_num(depth / DEPTH_UNIT, nan=0.0, posinf=0.0).round().clip(0, DEEPEST).astype(np.uint16)


def hello(spec: CameraSpec) -> Hello:
    """What a camera of this specification says of itself."""
    T = spec.T_colour_depth
    x, y, z = T.t.tolist()
    rotation = tuple(T.R.reshape(-1).tolist())
    return Hello(SERIAL, _lens(spec.colour), _lens(spec.depth), rotation, (x, y, z), DEPTH_UNIT, round(1.0 / spec.period))


def _lens(imager: Imager) -> Lens:
    return Lens(imager.width, imager.height, imager.focal, imager.centre, imager.distortion)
