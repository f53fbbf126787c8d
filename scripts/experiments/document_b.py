"""What document B's experiments have in common: options, what the paper reports, maps that are made once."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Annotated

from tyro.conf import arg

from scripts.errors import UsageError
from scripts.experiments.contest import Method, methods
from scripts.experiments.drive import Course
from scripts.experiments.paper_table import PaperFigures
from scripts.options import OptionalFile
from slam.depth_scans import DepthScan
from slam.messages import SensorFrame

MAPPING_SEED = 100
"""Added to the seed of a drive: the map is made in a run of its own."""
HALL = {"perfect match, Kinect": PaperFigures((13.3, 17.5, 0.12), (15.3, 20.2, 0.18))}
CORRIDOR = {"perfect match": PaperFigures(milliseconds=13.7), "particle filter": PaperFigures(milliseconds=21.8)}
DISTURBANCE = {
    "perfect match": PaperFigures((17.3, 17.5, 0.18), (21.3, 21.1, 0.26)),
    "perfect match, disturbed": PaperFigures((20.7, 21.6, 0.24), (25.7, 26.6, 0.31)),
}
"""Reported by the document, with the TurtleBot's own localization as the truth."""


@dataclass(frozen=True)
class DocumentBOptions:
    """Of all experiments of document B."""

    seeds: Annotated[tuple[int, ...], arg(metavar="N...")] = (1, 2, 3)
    """Seeds of the drives; each has a map of its own."""
    pipelines: Annotated[tuple[str, ...], arg(metavar="NAME...", help_behavior_hint="(default: all localizers)")] = ()
    """Localizers that run on the recordings, beside odometry."""
    out: OptionalFile = None
    """Write table, errors over time and their picture into this folder."""

    def check(self, duration: float) -> None:
        """Raise UsageError where an option makes no sense."""
        if not self.seeds or min(self.seeds) < 0:
            raise UsageError("--seeds: give one or more integers, 0 or above")
        if not (math.isfinite(duration) and duration >= 2.0):
            raise UsageError(f"--duration {duration:g}: give at least 2 seconds")

    def methods(self) -> dict[str, Method]:
        """Those chosen, and odometry.

        Raises:
            UnknownNameError: no such localizer.
        """
        return methods(*self.pipelines)


def seen_by_depth(frame: SensorFrame) -> SensorFrame:
    """A frame whose scans are those of its depth images, so that every localizer can run on them; the images are left out."""
    depth = DepthScan()
    scans = tuple(depth.scan(image) for image in frame.images)
    return dataclasses.replace(frame, images=(), scans=scans, available=frame.available - {"images"} | {"scans"})


def depth_course(world: str, duration: float, seed: int) -> Course:
    """A drive whose only scans are those of the depth camera."""
    return Course(world, duration, seed, camera="raster", keep=seen_by_depth)
