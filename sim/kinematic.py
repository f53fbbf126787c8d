"""The kinematic twin: wheels that roll on a plane under the PyBullet twin's devices; without PyBullet and without Embree."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

from msgspec import structs

from hardware.spec import DriveSpec, RobotSpec
from sim.drive import make_drive
from sim.lidar import CASTERS, static_rays
from sim.living import Living
from sim.moving import living_bodies
from sim.painters import PAINTERS
from sim.realism import read_realism
from sim.scenery import Scenery
from sim.simulation import Simulation
from sim.stage import Stage
from sim.twin import TwinRobot, require_known
from sim.unicycle import Unicycle
from worlds.world import World

CAMERAS: tuple[Literal["raster", "embree", "none"], ...] = ("raster", "embree", "none")


@dataclass(frozen=True, slots=True)
class Kinematic:
    """The kinematic twin."""

    world: str = "aruco_room"
    """World by name, `name:option=value,...`, or a path to a .toml."""
    seed: int = 0
    """Of all noise."""
    rays: Literal["grid", "embree"] = "grid"
    """Ray caster of the lidar; grid is the fast one, embree its reference."""
    camera: Literal["raster", "embree", "none"] = "none"
    """What draws the camera's images: raster is the fast one, embree its reference; none: it is off."""
    realism: str = "datasheet"
    """How far body and devices are from their specification: a name, or `NAME:GROUP.FIELD=VALUE,...`, see `sim.realism`."""
    spec: RobotSpec = field(default_factory=RobotSpec)
    """What the robot's owner believes it to be."""

    def __post_init__(self) -> None:
        read_realism(self.realism)
        require_known(self.seed, rays=(self.rays, CASTERS), camera=(self.camera, CAMERAS))
        if self.camera == "none":
            object.__setattr__(self, "spec", replace(self.spec, camera=None))

    def build(self) -> TwinRobot:
        """Make the twin; nothing is opened yet."""
        return TwinRobot(self)

    def simulate(self, world: World, seed: int) -> Simulation:
        """See `sim.twin.Twin`."""
        realism, lidar = read_realism(self.realism), self.spec.lidar
        living, firm = Living(world), _firm(world)
        body = Unicycle(firm, realism.true_spec(self.spec))
        rays, through_glass = static_rays(firm, CASTERS[self.rays])
        moving = living_bodies(living, lidar) if lidar is not None else ()
        drive = make_drive(self.spec.drive or DriveSpec(), realism.drive)
        scenery = Scenery(firm, living) if self.spec.camera else None
        painter = PAINTERS[self.camera](scenery) if scenery else None
        return Simulation(world, self.spec, realism, seed, Stage(body, drive, rays, living, moving, through_glass, scenery, painter))


def _firm(world: World) -> World:
    """The world with nothing in it that can be pushed."""
    boxes = tuple(structs.replace(box, mass=0.0) for box in world.boxes)
    return structs.replace(world, boxes=boxes, cylinders=tuple(structs.replace(cylinder, mass=0.0) for cylinder in world.cylinders))
