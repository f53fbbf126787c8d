"""People in a camera's pictures: windows where the depth image has something of their size, judged by HOG.

The windows from depth are as in Munaro, Menegatti, "Fast RGB-D people tracking for service robots" (2014).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from slam.depth_scans import DepthScan
from slam.errors import ParameterError, require_not_negative, require_positive
from slam.landmarks.hog_windows import Box, LevelPicture, overlap
from slam.messages import LaserScan, RgbdImage
from slam.se2 import FloatArray

Point = tuple[float, float]

GAP = 0.02
"""A silhouette's directions are no farther apart [rad]."""
FLOOR = 0.1
"""What is lower may be the floor [m]."""


@dataclass(frozen=True, slots=True)
class PersonSighting:
    """Somebody in a picture."""

    stamp: float
    """Of the picture [s]."""
    left: Point
    """Left edge of what the depth image shows of the body, seen from above, (x, y) in base at that time [m]."""
    right: Point
    """Right edge."""
    score: float
    """Probability that it is a person."""
    box: Box
    """The detector's window in the picture turned level, see `hog_windows.levelling`."""


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A place that somebody may stand at."""

    score: float
    box: Box
    distance: float
    """Of the silhouette from the camera [m]."""


@dataclass(frozen=True, slots=True)
class PeopleDetector:
    """Finds whole people who stand upright; nearer than 2 m the EV3's camera sees only their legs, and the detector nobody."""

    silhouette: DepthScan = field(default_factory=lambda: DepthScan(low=0.9, high=1.7, range_max=8.0))
    """What stands as high as a trunk, as seen from above: where windows are proposed."""
    widths: tuple[float, float] = (0.12, 1.5)
    """Narrowest and widest silhouette that may be people [m]."""
    nearest: float = 1.8
    """Nearer silhouettes are left out [m]."""
    depth: float = 0.2
    """From the front of a body to its axis [m]."""
    step: float = 0.15
    """From one window to the next along a silhouette [m]."""
    height: float = 1.75
    """Of people, for the first window at each place [m]."""
    heights: tuple[float, ...] = (1.6, 1.9)
    """Of people, where the first window is promising [m]."""
    promising: float = -1.2
    """Score of the SVM from which the other heights are tried."""
    sure: float = 0.2
    """Score of the SVM from which a window is a person."""
    slope: float = 2.0
    """Of the logistic function that turns a score into a probability (Platt 1999)."""
    overlap: float = 0.3
    """Of two windows with more in common (intersection over union) the better one stays."""
    reach: float = 0.5
    """A body's depth pixels are so near to the distance of its silhouette [m]."""

    def __post_init__(self) -> None:
        require_positive(self, "nearest", "step", "height", "slope", "reach")
        require_not_negative(self, "overlap")
        if not 0.0 < self.widths[0] < self.widths[1]:
            raise ParameterError(self, "widths", "two numbers above 0, the smaller one first")

    def detect(self, image: RgbdImage) -> tuple[PersonSighting, ...]:
        """Everybody who is found, from the surest to the least sure."""
        picture = LevelPicture(image.colour, image.colour_info)
        found = [one for one in self._candidates(image, picture) if one.score > self.sure]
        kept: list[_Candidate] = []
        for one in sorted(found, key=lambda candidate: -candidate.score):
            if all(overlap(one.box, other.box) <= self.overlap for other in kept):
                kept.append(one)
        cloud = _cloud(image) if kept else np.empty((0, 3))
        sightings = (self._sighting(image, cloud, picture, one) for one in kept)
        return tuple(sighting for sighting in sightings if sighting is not None)

    def _candidates(self, image: RgbdImage, picture: LevelPicture) -> Iterator[_Candidate]:
        """The best window at each place along each silhouette of people's width."""
        scan = self.silhouette.scan(image)
        for angles, ranges in _silhouettes(scan):
            distance = float(np.median(ranges))
            width = distance * float(angles[-1] - angles[0])
            if distance < self.nearest or not self.widths[0] <= width <= self.widths[1]:
                continue
            count = 1 + 2 * max(1, round(0.5 * width / self.step))
            margin = min(0.5 * self.step, 0.25 * width) / distance
            first, last = float(angles[0]) + margin, float(angles[-1]) - margin
            for k in range(count):
                angle = first + (last - first) * k / (count - 1)
                axis = (distance + self.depth) * np.array([[math.cos(angle), math.sin(angle), 0.0]])
                foot = scan.T_base_laser.transform(axis)[0]
                score, box = self._best(picture, (float(foot[0]), float(foot[1])))
                yield _Candidate(score, box, distance)

    def _best(self, picture: LevelPicture, foot: Point) -> tuple[float, Box]:
        """Score and window of the height that fits best at a place of base [m]."""
        box = picture.window(foot, self.height)
        best = picture.score(box), box
        if best[0] > self.promising:
            others = (picture.window(foot, height) for height in self.heights)
            best = max(best, *((picture.score(other), other) for other in others))
        return best

    def _sighting(self, image: RgbdImage, cloud: FloatArray, picture: LevelPicture, found: _Candidate) -> PersonSighting | None:
        """The extent of a body by its depth pixels inside the window, which is far wider; None where there are none."""
        (columns, rows), (x, y, w, h) = picture.project(cloud), found.box
        eye = np.array(image.depth_info.T_base_camera.t[:2])
        offsets = cloud[:, :2] - eye
        near = abs(np.hypot(offsets[:, 0], offsets[:, 1]) - found.distance) < self.reach
        offsets = offsets[near & (columns > x) & (columns < x + w) & (rows > y) & (rows < y + h)]
        if len(offsets) < 4:
            return None
        middle = offsets.mean(axis=0)
        across = np.array([-middle[1], middle[0]])
        tangents = (offsets @ across) / (offsets @ middle)
        right, left = ((eye + middle + t * across).tolist() for t in np.percentile(tangents, (1.0, 99.0)))
        probability = 1.0 / (1.0 + math.exp(-self.slope * found.score))
        return PersonSighting(image.stamp, (left[0], left[1]), (right[0], right[1]), probability, found.box)


def _silhouettes(scan: LaserScan) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Directions (K,) [rad] and ranges (K,) [m] of what hangs together."""
    seen = np.isfinite(scan.ranges)
    angles, ranges = scan.angles[seen], scan.ranges[seen]
    apart = (np.diff(angles) > GAP) | (abs(np.diff(ranges)) > 0.2 + 0.01 * ranges[:-1] ** 2)
    ends = [0, *(np.flatnonzero(apart) + 1).tolist(), len(ranges)]
    for start, end in pairwise(ends):
        if end - start > 2:
            yield angles[start:end], ranges[start:end]


def _cloud(image: RgbdImage) -> FloatArray:
    """Points (N, 3) [m] in base of every other pixel of the depth image, above the floor."""
    depth, info = image.depth[::2, ::2], image.depth_info
    rows, columns = np.nonzero(depth > 0.0)
    z = depth[rows, columns].astype(np.float64)
    pixels = np.stack([2.0 * columns, 2.0 * rows, np.ones(len(z))])
    points = info.T_base_camera.transform((np.linalg.inv(info.K) @ pixels * z).T)
    return points[points[:, 2] > FLOOR]
