"""Fills a software device of the vendor's library with the images of an emulated D435, in the process of the driver.

The library forgets a device that was only added to a context, so this module keeps the event that tells of it
(seen with 2.54 to 2.59); the driver then finds, configures and reads the device like one on USB.
"""

from __future__ import annotations

import threading
import time
from typing import Any

import numpy as np

from hardware.drivers.device_clock import DeviceClock
from hardware.drivers.errors import LinkError
from hardware.drivers.realsense_sdk import load_sdk
from hardware.drivers.transport import TcpTransport
from hardware.errors import HardwareError
from hardware.protocols import camera_frames
from hardware.protocols.camera_frames import Hello, Kind, Lens, Message, Messages, Pair

TCP_PORT = 5435
HELLO_TIME = 1.0
"""Longest wait for the camera's first words, and for its time [s]."""
ASKING = 0.25
"""Between two questions for the camera's time [s]."""
LISTENING = 0.05
"""[s]"""
EXCHANGES = 8
"""Of times before the first image."""


class Feeder:
    """An emulated camera, connected. Implements `hardware.drivers.realsense.Camera`."""

    def __init__(self, host: str, port: int) -> None:
        """Connect, build the device.

        Raises:
            DeviceError: nobody answers there, or the vendor's library is missing.
        """
        self._transport = TcpTransport(host, port)
        self._messages = Messages()
        self._clock = DeviceClock()
        self._asked: dict[int, float] = {}
        self._ended = threading.Event()
        try:
            sdk, hello = load_sdk(), self._hello()
            for _ in range(EXCHANGES):
                self._exchange_times()
        except HardwareError:
            self._transport.close()
            raise
        self._device = SoftwareCamera(sdk, hello)
        self.context, self.serial = self._device.context, hello.serial
        self._thread = threading.Thread(target=self._feed, name="camera feeder", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """See `Camera`."""
        self._ended.set()
        self._thread.join()
        self._transport.close()

    def _feed(self) -> None:
        """Pass images on until the end, or until the link breaks: then no image comes any more, as from a camera that is unplugged."""
        due = 0.0
        while not self._ended.is_set():
            try:
                if time.monotonic() > due:
                    self._ask()
                    due = time.monotonic() + ASKING
                for message in self._messages.feed(self._transport.read(LISTENING)):
                    self._take(message)
            except HardwareError:
                return

    def _take(self, message: Message) -> None:
        if message.kind == Kind.TIME:
            number, time_us = camera_frames.parse_time(message.body)
            sent = self._asked.pop(number, None)
            if sent is not None:
                self._clock.observe(sent, 1e-6 * time_us, time.monotonic())
        elif message.kind == Kind.PAIR:
            pair = camera_frames.parse_pair(message.body)
            wall = time.time() - time.monotonic()
            self._device.show(pair, 1e3 * (self._clock.host_time(1e-6 * pair.sent_us) + wall))

    def _ask(self) -> None:
        number = len(self._asked) and max(self._asked) + 1
        self._asked[number] = time.monotonic()
        self._transport.write(camera_frames.pack_time(number))

    def _exchange_times(self) -> None:
        self._ask()
        end = time.monotonic() + HELLO_TIME
        while self._asked and (left := end - time.monotonic()) > 0.0:
            for message in self._messages.feed(self._transport.read(left)):
                if message.kind == Kind.TIME:
                    self._take(message)
        if self._asked:
            raise LinkError("camera", "it does not tell its time", "check that this is the camera's port of `twin emulate`")

    def _hello(self) -> Hello:
        end = time.monotonic() + HELLO_TIME
        while (left := end - time.monotonic()) > 0.0:
            for message in self._messages.feed(self._transport.read(left)):
                if message.kind == Kind.HELLO:
                    return camera_frames.parse_hello(message.body)
        raise LinkError("camera", "it does not say what it is", "check that this is the camera's port of `twin emulate`")


class SoftwareCamera:
    """A device of the vendor's library that shows what it is given."""

    def __init__(self, sdk: Any, hello: Hello) -> None:
        self._sdk = sdk
        self._unit = hello.depth_unit
        self._device = sdk.software_device()
        self._device.register_info(sdk.camera_info.name, "Intel RealSense D435")
        self._device.register_info(sdk.camera_info.serial_number, hello.serial)
        self._sensors = self._device.add_sensor("Stereo Module"), self._device.add_sensor("RGB Camera")
        depth = self._stream(sdk.stream.depth, sdk.format.z16, 2, hello.depth, hello.rate)
        colour = self._stream(sdk.stream.color, sdk.format.rgb8, 3, hello.colour, hello.rate)
        self._profiles = self._sensors[0].add_video_stream(depth), self._sensors[1].add_video_stream(colour)
        self._sensors[0].add_read_only_option(sdk.option.depth_units, hello.depth_unit)
        extrinsics = sdk.extrinsics()
        extrinsics.rotation = np.array(hello.rotation).reshape(3, 3).T.reshape(-1).tolist()
        extrinsics.translation = list(hello.translation)
        self._profiles[0].register_extrinsics_to(self._profiles[1], extrinsics)
        self._device.create_matcher(sdk.matchers.default)
        self._kept: list[Any] = []
        self.context = sdk.context()
        self.context.set_devices_changed_callback(self._keep)
        self._device.add_to(self.context)

    def show(self, pair: Pair, stamp_ms: float) -> None:
        """Give the driver two images, sent at `stamp_ms` of the host's calendar clock."""
        value = self._sdk.frame_metadata_value
        for sensor, profile, pixels in zip(self._sensors, self._profiles, (pair.depth, pair.colour), strict=True):
            sensor.set_metadata(value.frame_timestamp, pair.sent_us)
            sensor.set_metadata(value.sensor_timestamp, pair.middle_us)
            frame = self._sdk.software_video_frame()
            frame.pixels = np.array(pixels)  # the library keeps it
            frame.bpp = pixels.itemsize * (pixels.shape[2] if pixels.ndim == 3 else 1)
            frame.stride = frame.bpp * pixels.shape[1]
            frame.timestamp = stamp_ms
            frame.domain = self._sdk.timestamp_domain.global_time
            frame.frame_number = pair.number
            frame.profile = profile.as_video_stream_profile()
            frame.depth_units = self._unit if sensor is self._sensors[0] else 0.0
            sensor.on_video_frame(frame)

    def _keep(self, event: Any) -> None:
        self._kept.append((event, event.get_new_devices()))

    def _stream(self, kind: Any, form: Any, bytes_per_pixel: int, lens: Lens, rate: int) -> Any:
        intrinsics, stream = self._sdk.intrinsics(), self._sdk.video_stream()
        intrinsics.width, intrinsics.height = lens.width, lens.height
        (intrinsics.fx, intrinsics.fy), (intrinsics.ppx, intrinsics.ppy) = lens.focal, lens.centre
        intrinsics.model, intrinsics.coeffs = self._sdk.distortion.brown_conrady, list(lens.distortion)
        stream.type, stream.index, stream.uid = kind, 0, int(kind == self._sdk.stream.color) + 1
        stream.width, stream.height, stream.fps = lens.width, lens.height, rate
        stream.bpp, stream.fmt, stream.intrinsics = bytes_per_pixel, form, intrinsics
        return stream
