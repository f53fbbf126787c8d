"""Points in a picture that are found again in another one, by name: ORB, SIFT, and any feature network in an ONNX file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from slam.errors import require_positive
from slam.landmarks.feature_network import FeatureNetwork
from slam.se2 import FloatArray

Grey = NDArray[np.uint8]
CELL = 64
"""Side of the cells over which points are spread [px]."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Feature points of one picture, the strongest first."""

    pixels: FloatArray
    """(N, 2) column, row."""
    descriptors: NDArray[np.uint8 | np.float32]
    """(N, D): bits are compared by Hamming's distance, numbers by Euclid's."""
    strengths: FloatArray
    """(N,) of whatever kind, larger is better."""


class Extractor(Protocol):
    """Finds feature points; keeps nothing from picture to picture."""

    def find(self, grey: Grey) -> Found:
        """Feature points of a picture (H, W)."""
        ...


class Features(Protocol):
    """A frozen dataclass of parameters that builds an extractor."""

    def build(self) -> Extractor:
        """Make the extractor.

        Raises:
            FeatureNetworkError: its network cannot be read.
        """
        ...


@dataclass(frozen=True, slots=True)
class Orb:
    """Oriented FAST corners with rotated BRIEF bits: Rublee, Rabaud, Konolige, Bradski (2011)."""

    count: int = 1000
    """At most."""
    threshold: int = 8
    """Least difference of grey levels at a corner."""

    def __post_init__(self) -> None:
        require_positive(self, "count", "threshold")

    def build(self) -> Extractor:
        """Make the extractor."""
        return _OpenCv(cv2.ORB.create(self.count, fastThreshold=self.threshold), np.dtype(np.uint8), 32)


@dataclass(frozen=True, slots=True)
class Sift:
    """Blobs in scale space: Lowe (2004). Thirty times slower than ORB."""

    count: int = 1000
    """At most."""
    contrast: float = 0.01
    """Least contrast of a blob."""

    def __post_init__(self) -> None:
        require_positive(self, "count", "contrast")

    def build(self) -> Extractor:
        """Make the extractor."""
        return _OpenCv(cv2.SIFT.create(self.count, contrastThreshold=self.contrast), np.dtype(np.float32), 128)


@dataclass(frozen=True, slots=True)
class OnnxFeatures:
    """A feature network, run by OpenCV; see `slam.landmarks.feature_network` for what its outputs may be."""

    file: str = ""
    """ONNX file."""
    count: int = 1000
    """At most."""
    threshold: float = 0.005
    """Least score of a point."""

    def __post_init__(self) -> None:
        require_positive(self, "count", "threshold")

    def build(self) -> Extractor:
        """Make the extractor.

        Raises:
            FeatureNetworkError: the file is missing or is no network that OpenCV can read.
        """
        return _Network(FeatureNetwork.read(self.file), self.count, self.threshold)


FEATURES: dict[str, type[Features]] = {"orb": Orb, "sift": Sift, "onnx": OnnxFeatures}
"""name -> frozen dataclass of parameters."""


def spread(pixels: FloatArray, strengths: FloatArray, count: int) -> NDArray[np.int64]:
    """Places of at most so many of the points (N, 2), (N,): the strongest of each part of the picture before the second of any."""
    cells = (pixels // CELL).astype(np.int64)
    keys = cells[:, 1] * 10_000 + cells[:, 0]
    order = np.lexsort((-strengths, keys))
    firsts = np.flatnonzero(np.diff(keys[order], prepend=-1))
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order)) - np.repeat(firsts, np.diff(np.append(firsts, len(order))))
    return np.lexsort((-strengths, rank))[:count]


def matched(a: Found, b: Found) -> NDArray[np.int64]:
    """Pairs (M, 2) of points of a and b that are each other's nearest."""
    if len(a.pixels) == 0 or len(b.pixels) == 0:
        return np.empty((0, 2), np.int64)
    norm = cv2.NORM_HAMMING if a.descriptors.dtype == np.uint8 else cv2.NORM_L2
    pairs = cv2.BFMatcher(norm, crossCheck=True).match(a.descriptors, b.descriptors)
    return np.array([(pair.queryIdx, pair.trainIdx) for pair in pairs], dtype=np.int64).reshape(-1, 2)


@dataclass(frozen=True, slots=True)
class _OpenCv:
    detector: cv2.Feature2D
    dtype: np.dtype[np.uint8] | np.dtype[np.float32]
    length: int
    """Of a descriptor."""

    def find(self, grey: Grey) -> Found:
        points, descriptors = self.detector.detectAndCompute(grey, None)  # type: ignore[call-overload]
        if len(points) == 0:
            return Found(np.empty((0, 2)), np.empty((0, self.length), self.dtype), np.empty(0))
        strengths = np.array([point.response for point in points])
        order = np.argsort(-strengths, kind="stable")
        pixels = np.array([point.pt for point in points], dtype=np.float64)
        return Found(pixels[order], np.asarray(descriptors, self.dtype)[order], strengths[order])


@dataclass(frozen=True, slots=True)
class _Network:
    network: FeatureNetwork
    count: int
    threshold: float

    def find(self, grey: Grey) -> Found:
        pixels, descriptors, scores = self.network.run(grey)
        order = np.argsort(-scores, kind="stable")[: self.count]
        order = order[scores[order] >= self.threshold]
        return Found(pixels[order], descriptors[order], scores[order])
