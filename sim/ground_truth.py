"""The only door to the truth, beside the HAL and never through it."""

from __future__ import annotations

import math

import numpy as np

from hardware.hal import Robot
from sim.camera_truth import CameraTruth
from sim.errors import TruthError
from sim.simulation import Simulation
from sim.twin import TwinRobot
from slam.grid import FREE, OCCUPIED, GridGeometry, OccupancyGrid
from slam.messages import Trajectory
from slam.se2 import SE2, FloatArray
from worlds.raster import components


class GroundTruth:
    """What is really so in the current episode of a twin; stays readable after the twin is closed."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation

    def pose(self, t: float) -> SE2:
        """T_world_base at a past time `t` [s], interpolated between physics steps.

        Raises:
            TruthError: `t` is before the start or in the future.
        """
        self._check_past(t)
        return self._simulation.motion.pose_at(t)

    def people(self, t: float) -> tuple[SE2, ...]:
        """T_world_person of everybody at a past time `t` [s], in the order of `World.people`: where they stand, x forward.

        Raises:
            TruthError: `t` is before the start or in the future.
        """
        self._check_past(t)
        return self._simulation.living.people(t)

    def camera(self) -> CameraTruth:
        """What is really before the camera.

        Raises:
            TruthError: the twin's camera is off.
        """
        return CameraTruth(self._simulation)

    def trajectory(self, stamps: FloatArray) -> Trajectory:
        """T_world_base at past times (N,) [s].

        Raises:
            TruthError: a time is before the start or in the future.
        """
        poses = [self.pose(t).as_array() for t in np.asarray(stamps, dtype=np.float64).tolist()]
        return Trajectory(stamps, np.array(poses).reshape(-1, 3))

    @property
    def collisions(self) -> int:
        """How often the robot has begun to touch a wall, a thing or a person; the kinematic twin's people do not touch."""
        return self._simulation.collisions

    def segments(self) -> FloatArray:
        """True walls (N, 4) as x0 y0 x1 y1 [m] in the world at the lidar's height.

        What can be pushed stands where it stood at the start.
        """
        lidar = self._simulation.spec.lidar
        return self._simulation.world.outlines(float(lidar.T_base_laser.t[2]) if lidar is not None else 0.1)

    def grid(self, resolution: float = 0.05) -> OccupancyGrid:
        """True grid in the world: surfaces are occupied, what the start can reach is free, the rest is unknown."""
        geometry = self._geometry(resolution)
        states = np.full((geometry.height, geometry.width), -1, np.int8)
        cells = geometry.to_cells(_surface_points(self.segments(), resolution))
        states[cells[:, 0], cells[:, 1]] = OCCUPIED
        rooms = components(states != OCCUPIED)
        row, col = geometry.to_cells(np.array([self._simulation.world.start[:2]]))[0]
        states[rooms == rooms[row, col]] = FREE
        return OccupancyGrid.from_states(geometry, states)

    def _check_past(self, t: float) -> None:
        end = max(self._simulation.now, self._simulation.motion.end)
        if not 0.0 <= t <= end:
            raise TruthError(f"no true pose at {t} s; the twin knows 0 to {end:.3f} s")

    def _geometry(self, resolution: float) -> GridGeometry:
        """Cells whose corners lie at multiples of the resolution, one cell of margin round the world."""
        x0, y0, x1, y1 = self._simulation.world.bounds
        left, low = math.floor(x0 / resolution) - 1, math.floor(y0 / resolution) - 1
        width, height = math.ceil(x1 / resolution) + 1 - left, math.ceil(y1 / resolution) + 1 - low
        return GridGeometry(resolution, width, height, SE2(left * resolution, low * resolution, 0.0))


def ground_truth(robot: Robot) -> GroundTruth:
    """The truth about a twin's current episode, or its last one.

    Raises:
        TruthError: the robot is no twin, or was never open.
    """
    if not isinstance(robot, TwinRobot):
        raise TruthError(f"a {type(robot).__name__} has no ground truth; only the twin has")
    if robot.simulation is None:
        raise TruthError("the twin was never open; there is no truth yet")
    return GroundTruth(robot.simulation)


def _surface_points(segments: FloatArray, resolution: float) -> FloatArray:
    """Points (N, 2) [m] along the segments, nudged into the solid on their left: a surface on a cell border belongs to the solid's cell."""
    points: list[FloatArray] = []
    for x0, y0, x1, y1 in segments.tolist():
        a, b = np.array([x0, y0]), np.array([x1, y1])
        length = float(np.linalg.norm(b - a))
        along = (b - a) / length
        inward = np.array([-along[1], along[0]]) * 1e-3 * resolution
        places = np.linspace(0.0, length, math.ceil(4.0 * length / resolution) + 1)[:, None]
        points.append(a + places * along + inward)
    return np.concatenate(points)
