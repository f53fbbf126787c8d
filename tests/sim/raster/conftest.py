from collections.abc import Callable
from dataclasses import dataclass

import pytest

from hardware.spec import RobotSpec
from sim.living import Living
from sim.painters import PAINTERS
from sim.raster.painter import RasterPainter
from sim.scenery import Scenery
from slam.se3 import SE3
from worlds.loader import load_world
from worlds.world import World

SPEC = RobotSpec()


@dataclass(frozen=True)
class Studio:
    """A world before a camera."""

    world: World
    scenery: Scenery
    painter: RasterPainter

    def view(self, x: float, y: float, yaw: float):
        """From the camera of a robot that stands there."""
        return self.scenery.views_of(SE3.from_xyz_rpy((x, y, 0.0), (0.0, 0.0, yaw)) @ SPEC.T_base_camera)


@pytest.fixture(scope="session")
def studio() -> Callable[[World], Studio]:
    """A world as the camera sees it."""

    def make(world: World) -> Studio:
        scenery = Scenery(world, Living(world))
        return Studio(world, scenery, PAINTERS["raster"](scenery))

    return make


@pytest.fixture(scope="session")
def markers(studio) -> Studio:
    """The room with markers round its walls."""
    return studio(load_world("aruco_room"))
