"""Intel RealSense cameras with colour and depth, through the vendor's library."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from hardware.camera_spec import CameraSpec, Imager
from hardware.drivers.device_thread import DeviceDriver, DeviceThread
from hardware.drivers.errors import DeviceError, LinkError
from hardware.drivers.realsense_sdk import load_sdk
from hardware.errors import HardwareError
from hardware.queues import EventQueue
from hardware.spec import RobotSpec
from slam.messages import CameraInfo, RgbdImage
from slam.se3 import SE3

START_TIME = 5.0
"""Longest wait for the first images [s]."""
SILENCE = 0.7
"""Without fresh images for so long the camera is lost [s]."""
LISTENING_MS = 100
"""Longest wait for images at once."""
USUAL_DELAY = 0.045
"""From a stamp to the arrival of the quickest images [s]; only for cameras that do not tell their time on the host's clock."""
QUICKEST_OF = 75
"""Images among which the quickest is looked for."""
LENSES = ("none", "brown_conrady", "inverse_brown_conrady", "modified_brown_conrady")
"""Distortions that five coefficients in OpenCV's order describe; the latter two within 0.01 px of it."""


class Camera(Protocol):
    """A camera that the vendor's library can see."""

    context: Any
    """Of the library, in which the camera is."""
    serial: str

    def close(self) -> None:
        """Let go. May be called twice."""
        ...


@dataclass
class PluggedCamera:
    """A camera on USB."""

    context: Any
    serial: str

    def close(self) -> None:
        """See `Camera`: nothing is held."""


def find_camera(serial: str = "") -> PluggedCamera:
    """The camera on USB, by its serial number when there are several.

    Raises:
        DeviceError: the vendor's library is missing, or the camera is.
    """
    sdk = load_sdk()
    context = sdk.context()
    found = [str(device.get_info(sdk.camera_info.serial_number)) for device in context.query_devices()]
    if serial and serial not in found:
        raise LinkError("camera", f"no RealSense {serial}, only {', '.join(found) or 'none'}", "plug it in, or write its number right")
    if not found:
        raise LinkError("camera", "no RealSense is plugged in", "plug it into a port of USB 3 and install librealsense's udev rules")
    return PluggedCamera(context, serial or found[0])


class RealSenseDriver(DeviceDriver):
    """Fills the queue of images from `open` to `close`."""

    def __init__(self, name: str, spec: RobotSpec, images: EventQueue[RgbdImage], find: Callable[[], Camera]) -> None:
        """Know how to find it.

        Args:
            name: of the camera, for messages.
            spec: the robot, with a camera.
            images: is filled.
            find: connects to the camera.
        """
        super().__init__(DeviceThread(f"camera at {name}", self._connect))
        self._spec = spec
        self._images = images
        self._find = find

    def open(self) -> None:
        """Start the streams.

        Raises:
            DeviceError: the camera is not there or has no such streams; nothing is held.
        """
        self._thread.open()

    def close(self) -> None:
        """Stop the streams and let go. May be called twice."""
        self._thread.close()

    def _connect(self) -> RealSenseSession:
        camera = self._find()
        try:
            return RealSenseSession(camera, self._spec, self._images.put)
        except HardwareError:
            camera.close()
            raise


class RealSenseSession:
    """A camera that streams. See `device_thread.Session`."""

    def __init__(self, camera: Camera, spec: RobotSpec, deliver: Callable[[RgbdImage], None]) -> None:
        self._camera = camera
        self._spec = spec.require_camera()
        self._deliver = deliver
        self._sdk = load_sdk()
        self._pipeline = self._sdk.pipeline(camera.context)
        profile = self._started()
        try:
            self._unit, self._infos = self._described(profile, spec.T_base_camera)
        except HardwareError:
            self._pipeline.stop()
            raise
        self._clock = StampClock(self._sdk.timestamp_domain.global_time)
        self._numbers = (-1, -1)
        self._last = float("-inf")
        self._patience = time.monotonic() + START_TIME
        self.stale = 0
        """Images that came twice, alone, or not of one moment."""

    def step(self) -> None:
        """See `Session`: pass images on."""
        try:
            came, frames = self._pipeline.try_wait_for_frames(LISTENING_MS)
        except RuntimeError as error:
            raise LinkError("camera", f"its streams have ended ({error})", "plug it in again") from error
        now = time.monotonic()
        if came and self._passed_on(frames, now):
            self._patience = now + SILENCE
        if now > self._patience:
            raise LinkError("camera", f"no fresh images for {SILENCE} s", "check the cable and plug it in again")

    def close(self) -> None:
        """See `Session`."""
        try:
            self._pipeline.stop()
        except RuntimeError:  # it was unplugged
            pass
        finally:
            self._camera.close()

    def _started(self) -> Any:
        sdk, config, rate = self._sdk, self._sdk.config(), round(1.0 / self._spec.period)
        config.enable_device(self._camera.serial)
        config.enable_stream(sdk.stream.depth, self._spec.depth.width, self._spec.depth.height, sdk.format.z16, rate)
        config.enable_stream(sdk.stream.color, self._spec.colour.width, self._spec.colour.height, sdk.format.rgb8, rate)
        try:
            profile = self._pipeline.start(config)
        except RuntimeError as error:
            raise LinkError("camera", f"it does not stream ({error})", "use a port of USB 3, or a mode it has in robot.toml") from error
        for sensor in profile.get_device().query_sensors():
            for option, value in ((sdk.option.auto_exposure_priority, 0.0), (sdk.option.global_time_enabled, 1.0)):
                if sensor.supports(option) and not sensor.is_option_read_only(option):
                    sensor.set_option(option, value)
        return profile

    def _described(self, profile: Any, T_base_camera: SE3) -> tuple[float, tuple[CameraInfo, CameraInfo]]:
        """Depth unit [m], and the infos of the colour and the depth imager."""
        sdk, spec = self._sdk, self._spec
        colour, depth = (profile.get_stream(stream).as_video_stream_profile() for stream in (sdk.stream.color, sdk.stream.depth))
        extrinsics = depth.get_extrinsics_to(colour)
        rotation = np.array(extrinsics.rotation, dtype=np.float64).reshape(3, 3).T  # the library counts down the columns
        T_colour_depth = SE3(rotation, np.array(extrinsics.translation, dtype=np.float64))
        if spec.T_colour_depth != CameraSpec().T_colour_depth:
            T_colour_depth = spec.T_colour_depth
        unit = float(profile.get_device().first_depth_sensor().get_depth_scale())
        own = replace(spec, colour=believed(spec.colour, colour.get_intrinsics()), depth=believed(spec.depth, depth.get_intrinsics()))
        return unit, (own.colour.info(T_base_camera), own.depth.info(T_base_camera @ T_colour_depth))

    def _passed_on(self, frames: Any, arrival: float) -> bool:
        """Whether there was a fresh pair of images."""
        colour, depth = frames.get_color_frame(), frames.get_depth_frame()
        if not colour or not depth:
            self.stale += 1
            return False
        numbers = int(colour.get_frame_number()), int(depth.get_frame_number())
        apart = 1e-3 * abs(colour.get_timestamp() - depth.get_timestamp())
        if any(new == old for new, old in zip(numbers, self._numbers, strict=True)) or apart > 0.5 * self._spec.period:
            self.stale += 1
            return False
        self._numbers = numbers
        stamp = self._clock.host_time(colour.get_timestamp(), colour.get_frame_timestamp_domain(), arrival) - self._lead(colour)
        if stamp <= self._last:
            self.stale += 1
            return False
        self._last = stamp
        steps = np.asanyarray(depth.get_data())
        self._deliver(RgbdImage(stamp, np.asanyarray(colour.get_data()), metres(steps, self._unit), *self._infos))
        return True

    def _lead(self, colour: Any) -> float:
        """From the middle of the exposure to the frame's stamp [s], where the camera tells it."""
        value = self._sdk.frame_metadata_value
        if not all(colour.supports_frame_metadata(name) for name in (value.frame_timestamp, value.sensor_timestamp)):
            return 0.0
        return 1e-6 * (colour.get_frame_metadata(value.frame_timestamp) - colour.get_frame_metadata(value.sensor_timestamp))


class StampClock:
    """Brings the library's stamps to the host's monotonic clock."""

    def __init__(self, global_time: object) -> None:
        """Know the library's name of stamps that are on the host's clock."""
        self._global_time = global_time
        self._delays: deque[float] = deque(maxlen=QUICKEST_OF)

    def host_time(self, stamp_ms: float, domain: object, arrival: float) -> float:
        """Time [s] of a stamp that arrived at `arrival` [s]."""
        stamp = 1e-3 * stamp_ms
        if domain == self._global_time:
            return stamp + (time.monotonic() - time.time())
        self._delays.append(arrival - stamp)
        return stamp + min(self._delays) - USUAL_DELAY


def metres(steps: NDArray[np.uint16], unit: float) -> NDArray[np.float32]:
    """Depths [m] of (H, W) steps of `unit` [m]; nan where there is none."""
    depth = steps.astype(np.float32) * np.float32(unit)
    depth[steps == 0] = np.nan
    return depth


def believed(imager: Imager, intrinsics: Any) -> Imager:
    """An imager as the factory has measured it, or as the specification says when that is not the data sheet's any more.

    Raises:
        DeviceError: the library describes the lens by what five coefficients cannot say.
    """
    model = str(intrinsics.model).rpartition(".")[2]
    coefficients = [float(value) for value in intrinsics.coeffs[:5]]
    if any(coefficients) and model not in LENSES:
        raise DeviceError("camera", f"its lens is described by '{model}'", f"calibrate it; known are {', '.join(LENSES)}")
    if not _is_of_the_data_sheet(imager):
        return imager
    k1, k2, p1, p2, k3 = coefficients
    focal, centre = (float(intrinsics.fx), float(intrinsics.fy)), (float(intrinsics.ppx), float(intrinsics.ppy))
    return replace(imager, focal=focal, centre=centre, distortion=(k1, k2, p1, p2, k3))


def _is_of_the_data_sheet(imager: Imager) -> bool:
    """Whether nobody has calibrated it: an ideal lens with square pixels, its centre in the middle."""
    middle = 0.5 * (imager.width - 1), 0.5 * (imager.height - 1)
    return imager.centre == middle and imager.focal[0] == imager.focal[1] and not any(imager.distortion)
