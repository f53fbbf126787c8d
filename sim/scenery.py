"""Everything that a camera can see in an episode, and where it is from moment to moment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.living import Living
from sim.motion import BODIES, STEP, Frames, Motion
from sim.raster.kernels.views import Views, frames_at, views_from
from sim.scene import middle, movable_solids
from sim.surfaces import Faces, body_faces, joined, mesh_faces, static_faces
from slam.se2 import FloatArray
from slam.se3 import SE3
from worlds.parts import Marker
from worlds.world import World

STILL = 1e-6
"""What moves and turns by less than this [m, rad] while a picture is taken stands still: a thousandth of a pixel."""


class Scenery:
    """The faces of a world, of what can be pushed in it and of what its clock moves, which are bodies 0, 1, 2 and so on."""

    def __init__(self, world: World, living: Living) -> None:
        movable = movable_solids(world)
        parts = [mesh_faces(part.meshes, part.material) for part in living.parts]
        self.faces: Faces = joined([static_faces(world), *(body_faces(solid) for solid in movable), *parts])
        self.light = world.light
        self.first_living = 1 + len(movable)
        """Number of the first body that the clock moves; they come in the order of `Living.parts`."""
        self._living = living
        self._movable = movable
        persons = np.concatenate([np.full(self.first_living, -1), living.persons]).astype(np.int32)
        self._persons = np.append(persons[self.faces.bodies], np.int32(-1))  # the last one is for no face

    def views(self, motion: Motion, mount: SE3, times: FloatArray) -> Views:
        """The camera of `T_base_camera` mount, seen from every body, at each of the times (K,) [s]; once where nothing moves.

        All times lie within the last second of the motion.
        """
        start, end = float(times[0]), float(times[-1])
        base = _at([motion.frames_between(start, end)], times)
        pushed = [motion.frames_between(start, end, BODIES + 7 * k) for k in range(self.first_living - 1)]
        moved = self._living.frames(start, end)
        bodies = np.concatenate([_at(pushed, times), frames_at(moved.values, (times - moved.first) / moved.step)])
        camera = _mounted(base[0], mount)
        if max(np.ptp(frames, axis=-2).max(initial=0.0) for frames in (camera, bodies)) < STILL:
            camera, bodies = camera[:1], bodies[:, :1]
        return views_from(camera, bodies)

    def views_of(self, T_world_camera: SE3, t: float = 0.0) -> Views:
        """A camera that stands still, at a time [s]; what can be pushed stands where it stood at the start."""
        moved = self._living.frames(t, t).values[:, :1]
        placed = [SE3.from_xyz_rpy((x, y, z), (0.0, 0.0, yaw)) for x, y, z, yaw in map(middle, self._movable)]
        return views_from(_frame(T_world_camera), np.concatenate([np.array([*map(_frame, placed)]).reshape(-1, 1, 12), moved]))

    def marker_faces(self, world: World) -> list[tuple[int, Marker]]:
        """Each marker of the world and the number of its print's face."""
        faces = np.flatnonzero(self.faces.textures < 0).tolist()
        return list(zip(faces, world.markers, strict=False))

    def people_of(self, ids: NDArray[np.int32]) -> NDArray[np.int32]:
        """Number in `World.people` of the person whose face each pixel (H, W) sees; -1: nobody's."""
        return self._persons[ids]


def _frame(T: SE3) -> FloatArray:
    """A frame (1, 12) that stays."""
    return np.concatenate([T.R.ravel(), T.t])[None]


def _at(frames: list[Frames], times: FloatArray) -> FloatArray:
    """Frames (B, K, 12) at times (K,) [s]."""
    if not frames:
        return np.empty((0, len(times), 12))
    return frames_at(np.stack([one.values for one in frames]), (times - frames[0].first) / STEP)


def _mounted(base: FloatArray, mount: SE3) -> FloatArray:
    """T_world_camera (K, 12) of T_world_base (K, 12)."""
    R, t = base[:, :9].reshape(-1, 3, 3), base[:, 9:]
    return np.hstack([(R @ mount.R).reshape(-1, 9), t + R @ mount.t])
