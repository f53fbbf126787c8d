"""What the robot's camera sees of a world."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hardware.camera_spec import Imager
from hardware.spec import RobotSpec
from sim.living import Living
from sim.raster.kernels.views import Views
from sim.raster.painter import Painter, RasterPainter
from sim.scenery import Scenery
from slam.se3 import SE3
from worlds.world import World

ROBOT = RobotSpec()
SMALL = Imager(212, 120, (153.0, 153.0), (105.5, 59.5))
"""What looks about for the best place: the colour imager at a quarter of its size."""
HEADINGS = 12
"""That the robot turns to at each waypoint of its tour."""
VISIBLE = 0.01
"""Share of the picture that somebody must fill to count."""
FAR = 6.0
"""Depth of a room that could not be better [m]."""
NEAR = 0.8
"""What is nearer stands in the way [m]."""
PRINTS = 4
"""Markers and posters in a picture that could not be better."""

Pose = tuple[float, float, float]


def camera_view(world: World, pose: Pose | None, t: float) -> NDArray[np.uint8]:
    """Picture (H, W, 3) of a world at time `t` [s] by a faultless camera on the robot at a pose x, y [m], yaw [rad]; or the best view."""
    scenery = Scenery(world, Living(world, t))
    painter = RasterPainter(scenery.faces, scenery.light)
    view = best_view(world, scenery, painter) if pose is None else _view(scenery, pose)
    colour = ROBOT.require_camera().colour
    picture = painter.colours(colour, view, painter.see(colour, view), scenery.light.level_at(t))
    return np.clip(np.rint(picture), 0.0, 255.0).astype(np.uint8)


def best_view(world: World, scenery: Scenery, painter: Painter) -> Views:
    """From the world's tour: the one that shows most people from head to foot and looks far into the room, at its prints."""
    places = world.tour or (world.start[:2],)
    poses = [world.start, *((*place, turn * math.tau / HEADINGS) for place in places for turn in range(HEADINGS))]
    return max((_view(scenery, pose) for pose in poses), key=lambda view: _interest(scenery, painter, view))


def whole_people(people: NDArray[np.int32]) -> int:
    """How many of `Scenery.people_of` (H, W) are in the picture with head and feet, and not too small."""
    border = np.concatenate([people[0], people[-1], people[:, 0], people[:, -1]])
    numbers, pixels = np.unique(people[people >= 0], return_counts=True)
    return int(np.sum(~np.isin(numbers, border) & (pixels > people.size * VISIBLE)))


def _view(scenery: Scenery, pose: Pose) -> Views:
    x, y, yaw = pose
    return scenery.views_of(SE3.from_xyz_rpy((x, y, 0.0), (0.0, 0.0, yaw)) @ ROBOT.T_base_camera)


def _interest(scenery: Scenery, painter: Painter, view: Views) -> float:
    """Somebody seen from head to foot counts 1, each of depth and prints 1 at most; a picture full of something near loses 1."""
    ids = painter.see(SMALL, view)
    depth = painter.depths(SMALL, view, ids)[ids >= 0]
    prints, pixels = np.unique(ids[(ids >= 0) & (scenery.faces.textures[ids] < 0)], return_counts=True)
    readable = len(prints[pixels > ids.size * VISIBLE / 5])
    far, near = (float(np.quantile(depth, (0.5, 0.8)).mean()), float(np.mean(depth < NEAR))) if len(depth) else (0.0, 0.0)
    return whole_people(scenery.people_of(ids)) + min(far / FAR, 1.0) + min(readable / PRINTS, 1.0) - near
