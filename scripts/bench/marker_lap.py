"""A drive among markers that `visual_slam` followed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from scripts.experiments.drive import Course
from scripts.runs.metrics import aligned_errors
from sim.ground_truth import ground_truth
from slam.landmarks.marker_chain import MarkerChain
from slam.landmarks.marker_map import MarkerMap
from slam.mapping.visual_slam import VisualSlam, VisualSlamPipeline
from slam.messages import SensorFrame, Trajectory
from slam.se2 import SE2, FloatArray
from worlds.loader import load_world

WRONG = 0.1
"""A pose that is so far off is one of a wrong branch: its way [m] and its turn [rad]."""


def as_it_is(frame: SensorFrame) -> SensorFrame:
    """The frame."""
    return frame


@dataclass(eq=False)
class Lap:
    """What was found, with the chain beside it; images are not kept."""

    pipeline: VisualSlamPipeline
    chain: MarkerChain
    truth: Trajectory
    estimate: Trajectory
    odometry: Trajectory
    """By wheels and gyro alone."""
    markers: list[int] = field(default_factory=list[int])
    """Seen in the newest image, at every frame; -1 before the first."""
    images: list[int] = field(default_factory=list[int])
    """That came with every frame."""

    @classmethod
    def driven(
        cls, world: str, length: tuple[float, int], given: MarkerMap | None = None, keep: Callable[[SensorFrame], SensorFrame] = as_it_is
    ) -> Lap:
        """Map a world, or localise in a map of it from an unknown start.

        Args:
            world: by name.
            length: of the drive [s], and the seed of all noise.
            given: the map.
            keep: what is heard of a frame.
        """
        pipeline = VisualSlamPipeline(VisualSlam(), None if given else SE2(*load_world(world).start), given)
        empty = Trajectory(np.empty(0), np.empty((0, 3)))
        lap = cls(pipeline, MarkerChain(), empty, empty, empty)
        stamps: list[float] = []
        said: list[tuple[FloatArray, FloatArray, FloatArray]] = []
        course = Course(world, *length, camera="raster", keep=keep)
        with course.body() as robot:
            truth = ground_truth(robot)
            for frame in course.follow(robot, truth):
                found, wheels = lap._take(frame)
                stamps.append(frame.stamp)
                said.append((truth.pose(frame.stamp).as_array(), found.as_array(), wheels.as_array()))
        pipeline.finish()
        lap.truth, lap.estimate, lap.odometry = (Trajectory(np.array(stamps), np.array(poses)) for poses in zip(*said, strict=True))
        return lap

    def errors(self, place: SE2 | None = None) -> tuple[FloatArray, FloatArray]:
        """Position (N,) [m] and heading (N,) [rad] of every frame, aligned where the map's place in the world is not given."""
        errors = aligned_errors(self.truth, self.estimate, place).errors
        return errors.translation, errors.heading

    def wrong(self) -> float:
        """Share of the frames whose pose is so wrong that a marker's wrong branch must have been believed."""
        off, turned = self.errors()
        return float(np.mean((off > WRONG) | (np.abs(turned) > WRONG)))

    def _take(self, frame: SensorFrame) -> tuple[SE2, SE2]:
        """The pose by all and by wheels and gyro."""
        found = self.pipeline.update(frame)
        detection = self.pipeline.detection
        self.images.append(len(frame.images))
        self.markers.append(len(detection.sightings) if detection else -1)
        if frame.images and detection is not None:
            self.chain.update(detection.sightings)
        return found.T_map_base, self.pipeline.motion.ego.motion.pose_at(frame.stamp)
