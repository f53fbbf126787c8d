"""What the camera of a run saw of the markers, kept for its pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from slam.fusion.pipeline import FusionPipeline
from slam.landmarks.sighting import Sighting
from slam.mapping.visual_slam import VisualSlamPipeline
from slam.messages import CameraInfo, Estimate
from slam.pipelines import Pipeline
from slam.se3 import SE3

WIDTH = 424
"""Of the pictures that are kept [px]."""


@dataclass(frozen=True, slots=True, eq=False)
class MarkerView:
    """A moment: the newest image with axes on its markers, and where the camera was."""

    stamp: float
    picture: NDArray[np.uint8]
    """(h, WIDTH, 3) red, green, blue."""
    T_map_camera: SE3
    seen: tuple[int, ...]
    """Ids."""


def marker_view(pipeline: Pipeline, estimate: Estimate) -> MarkerView | None:
    """What a pipeline with a camera sees now; None without an image, or while nothing tells where the camera is."""
    visual = pipeline.visual if isinstance(pipeline, FusionPipeline) else pipeline
    if not isinstance(visual, VisualSlamPipeline) or visual.image is None or visual.detection is None:
        return None
    mount = visual.image.colour_info.T_base_camera
    T_map_camera = estimate.T_map_camera or SE3.from_se2(estimate.T_map_base) @ mount
    sightings = visual.detection.sightings
    picture = with_axes(visual.image.colour, visual.image.colour_info, sightings)
    return MarkerView(estimate.stamp, picture, T_map_camera, tuple(s.id for s in sightings))


def with_axes(image: NDArray[np.uint8], camera: CameraInfo, sightings: Sequence[Sighting]) -> NDArray[np.uint8]:
    """A small copy of an image (H, W, 3) with each marker's frame: its border, x red, y green, z blue."""
    drawn = cv2.cvtColor(image, cv2.COLOR_RGB2BGR)
    for sighting in sightings:
        T = sighting.branches[0]
        cv2.polylines(drawn, [np.rint(sighting.pixels).astype(np.int32)], True, (40, 200, 255), 2, cv2.LINE_AA)
        cv2.drawFrameAxes(drawn, camera.K, camera.D, cv2.Rodrigues(T.R.copy())[0], T.t.copy(), 0.6 * sighting.size, 3)
    height = round(WIDTH * image.shape[0] / image.shape[1])
    small = cv2.resize(drawn, (WIDTH, height), interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.cvtColor(small, cv2.COLOR_BGR2RGB), np.uint8)
