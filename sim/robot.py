"""The PyBullet twin: parameters, and what they build."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from typing import Literal

from hardware.spec import DriveSpec, RobotSpec
from sim.bullet_rays import BulletRays
from sim.drive import make_drive
from sim.lidar import CASTERS, static_rays
from sim.living import Living
from sim.moving import MovingBodies, living_bodies, moving_bodies
from sim.painters import PAINTERS
from sim.physics import Physics
from sim.realism import read_realism
from sim.scenery import Scenery
from sim.simulation import Simulation
from sim.stage import Stage
from sim.twin import TwinRobot, require_known
from worlds.world import World


@dataclass(frozen=True, slots=True)
class Sim:
    """The PyBullet twin."""

    world: str = "aruco_room"
    """World by name, `name:option=value,...`, or a path to a .toml."""
    seed: int = 0
    """Of all noise."""
    rays: Literal["grid", "embree", "bullet"] = "grid"
    """Ray caster of the lidar: grid is the fast one, embree its reference, bullet is the physics' own and slow."""
    camera: Literal["raster", "embree", "tiny", "egl", "none"] = "none"
    """What draws the camera's images: raster is the fast one, embree its reference, tiny and egl are PyBullet's; none: it is off."""
    realism: str = "datasheet"
    """How far body and devices are from their specification: a name, or `NAME:GROUP.FIELD=VALUE,...`, see `sim.realism`."""
    spec: RobotSpec = field(default_factory=RobotSpec)
    """What the robot's owner believes it to be."""

    def __post_init__(self) -> None:
        read_realism(self.realism)
        require_known(self.seed, rays=(self.rays, (*CASTERS, "bullet")), camera=(self.camera, (*PAINTERS, "none")))
        if self.camera == "none":
            object.__setattr__(self, "spec", replace(self.spec, camera=None))

    def build(self) -> TwinRobot:
        """Make the twin; nothing is opened yet."""
        return TwinRobot(self)

    def simulate(self, world: World, seed: int) -> Simulation:
        """See `sim.twin.Twin`."""
        realism = read_realism(self.realism)
        with ExitStack() as held:
            living = Living(world)
            physics = Physics(world, realism.true_spec(self.spec), living, realism.drive)
            held.callback(physics.close)
            bullet = self.rays == "bullet"
            rays, through_glass = (BulletRays(physics.client), None) if bullet else static_rays(world, CASTERS[self.rays])
            drive = make_drive(self.spec.drive or DriveSpec(), realism.drive)
            moving = () if bullet else self._moving(world, living)
            scenery = Scenery(world, living) if self.spec.camera else None
            painter = PAINTERS[self.camera](scenery) if scenery else None
            stage = Stage(physics, drive, rays, living, moving, through_glass, scenery, painter)
            simulation = Simulation(world, self.spec, realism, seed, stage)
            held.pop_all()
        return simulation

    def _moving(self, world: World, living: Living) -> list[MovingBodies]:
        return [*moving_bodies(world), *(living_bodies(living, self.spec.lidar) if self.spec.lidar else ())]
