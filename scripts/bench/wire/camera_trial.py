"""A camera driver on a wire to an emulator whose images are known."""

from __future__ import annotations

import time
import zlib
from contextlib import ExitStack

from hardware.camera_spec import d435
from hardware.drivers.realsense import RealSenseDriver
from hardware.emulators.channels import TcpChannel
from hardware.emulators.d435 import D435, depth_steps
from hardware.emulators.port import Port
from hardware.ev3_robot import camera_finder
from hardware.queues import EventQueue
from hardware.spec import RobotSpec
from scripts.bench.wire.stage import WORLD
from scripts.bench.wire.trial import Trial
from sim.kinematic import Kinematic
from sim.wire import on_the_wire
from slam.messages import RgbdImage

SPEC = RobotSpec(lidar=None, camera=d435((424, 240), (424, 240), 6))
"""The smallest and slowest mode, for the images are drawn in the driver's process."""


class CameraTrial(Trial):
    """Looks at the hall."""

    def __init__(self) -> None:
        super().__init__("camera", Kinematic(world=WORLD, realism=on_the_wire("datasheet"), spec=SPEC, camera="raster"))
        self._told: dict[tuple[int, int], float] = {}

    def _connect(self, held: ExitStack) -> None:
        camera = D435(self._image, self.twin.now, SPEC.require_camera())
        self.port = held.enter_context(Port(camera, TcpChannel()))
        images = EventQueue[RgbdImage]()
        self._inbox = images.subscribe()
        self.driver = RealSenseDriver(self.port.address, SPEC, images, camera_finder(self.port.address))
        held.callback(self.driver.close)
        self.driver.open()

    def look(self) -> None:
        """Judge what has come: a pair of images that the camera did not take together is wrong."""
        for image in self._inbox.take():
            sent = self._told.get(_fingerprint(image))
            if sent is None:
                self.wrong += 1
            else:
                self.newest = sent

    def _image(self) -> RgbdImage | None:
        image = self.twin.next_image()
        if image is not None:
            self._told[_fingerprint(image)] = time.monotonic()
        return image


def _fingerprint(image: RgbdImage) -> tuple[int, int]:
    return zlib.crc32(image.colour.tobytes()), zlib.crc32(depth_steps(image.depth).tobytes())
