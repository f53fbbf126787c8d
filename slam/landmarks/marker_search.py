"""Where markers may be in an image, and which they are: our own search, and OpenCV's for comparison."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from slam.errors import ParameterError
from slam.kernels.darker import darker_than_around
from slam.kernels.marker_bits import read_markers
from slam.kernels.outlines import four_sided
from slam.landmarks.marker_corners import CornerMethod
from slam.landmarks.marker_family import MarkerFamily
from slam.se2 import FloatArray

Image = NDArray[np.uint8]
Ints = NDArray[np.int64]
SHARES = 0.12, 0.05
"""What is darker than about it by such a share is dark: at the first look, and where markers are pale."""
NOISE = 3.0
"""Least difference that is more than the camera's noise [grey levels]."""
COARSER = 1, 2, 4
"""Times that a picture is made smaller: soft edges are sharp then, and the neighbourhood wide."""
BRIGHT = 0.1
"""Share of the border's modules that may be bright."""
BITS = 64
"""A marker has no more."""
OPENCV: dict[CornerMethod, int] = {
    "none": cv2.aruco.CORNER_REFINE_NONE,
    "subpix": cv2.aruco.CORNER_REFINE_SUBPIX,
    "contour": cv2.aruco.CORNER_REFINE_CONTOUR,
    "apriltag": cv2.aruco.CORNER_REFINE_APRILTAG,
}


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """N markers, in no order."""

    corners: FloatArray
    """(N, 4, 2) top left, top right, bottom right, bottom left of the marker [px]."""
    numbers: Ints
    """(N,) in its dictionary."""
    families: Ints
    """(N,) place of the dictionary in the settings."""
    undecoded: int
    """Four-sided things that are no markers."""

    def only(self, chosen: Ints) -> Found:
        """Some of the markers."""
        return Found(self.corners[chosen], self.numbers[chosen], self.families[chosen], self.undecoded)

    def joined(self, other: Found) -> Found:
        """The markers, and those of another look that are elsewhere."""
        new = other.only(np.array([n for n, corners in enumerate(other.corners) if not self._has(corners)], np.int64))
        return Found(
            np.concatenate([self.corners, new.corners]),
            np.concatenate([self.numbers, new.numbers]),
            np.concatenate([self.families, new.families]),
            self.undecoded,
        )

    def _has(self, corners: FloatArray) -> bool:
        """A marker with about the same middle is among them."""
        apart = np.linalg.norm(self.corners.mean(axis=1) - corners.mean(axis=0), axis=1)
        return bool((apart < 0.5 * np.linalg.norm(corners[1] - corners[0])).any())


class MarkerSearch(Protocol):
    """Finds markers in a grey image (H, W)."""

    def find(self, grey: Image) -> Found:
        """All that there are."""
        ...


@dataclass(frozen=True, slots=True)
class Tolerance:
    """What a marker may be like."""

    error_correction: float
    """Share of the bits that a dictionary can correct which is corrected."""
    least_side: float
    """[px]"""
    least_contrast: float
    """[grey levels]"""


class OwnSearch:
    """Dark regions with four sides, read by all dictionaries."""

    def __init__(self, families: tuple[MarkerFamily, ...], tolerance: Tolerance, *, quick: bool) -> None:
        """Make the dictionaries' codes.

        Raises:
            ParameterError: a dictionary that there is not, or with more than 64 bits.
        """
        self._tolerance, self._quick = tolerance, quick
        dictionaries = [family.load() for family in families]
        self._codes = [_codes(family, dictionary) for family, dictionary in zip(families, dictionaries, strict=True)]
        self._modules = [int(dictionary.markerSize) + 2 for dictionary in dictionaries]
        self._wrong = [int(dictionary.maxCorrectionBits * tolerance.error_correction) for dictionary in dictionaries]

    def find(self, grey: Image) -> Found:
        """One look; another at paler things and at the picture made smaller, when it is not quick or nothing was found."""
        found = self._look(grey, 1, SHARES[0])
        if self._quick and len(found.numbers):
            return found
        for smaller in COARSER:
            picture = grey if smaller == 1 else cv2.resize(grey, None, fx=1.0 / smaller, fy=1.0 / smaller, interpolation=cv2.INTER_AREA)
            for share in SHARES[smaller == 1 :]:
                found = found.joined(self._look(np.asarray(picture, np.uint8), smaller, share))
        return found

    def _look(self, grey: Image, smaller: int, share: float) -> Found:
        least = max(self._tolerance.least_side / smaller, 4.0)
        corners = four_sided(darker_than_around(grey, share, NOISE), grey.shape[1], least)
        numbers, families = np.full(len(corners), -1, np.int64), np.zeros(len(corners), np.int64)
        for k, (codes, modules, wrong) in enumerate(zip(self._codes, self._modules, self._wrong, strict=True)):
            tolerance = self._tolerance.least_contrast, int(BRIGHT * 4 * (modules - 1)), wrong
            for n, (number, turn) in enumerate(read_markers(grey, corners, codes, modules, tolerance).tolist()):
                if number >= 0 and numbers[n] < 0:
                    corners[n], numbers[n], families[n] = np.roll(corners[n], turn, axis=0), number, k
        read = numbers >= 0
        return Found((corners[read] + 0.5) * smaller - 0.5, numbers[read], families[read], int((~read).sum()))


class OpenCvSearch:
    """OpenCV's detector, with one of its ways to the corners."""

    def __init__(self, families: tuple[MarkerFamily, ...], tolerance: Tolerance, corners: CornerMethod) -> None:
        """Make the detector.

        Raises:
            ParameterError: a dictionary that there is not.
        """
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = OPENCV[corners]
        parameters.errorCorrectionRate = tolerance.error_correction
        self._detector = cv2.aruco.ArucoDetector([family.load() for family in families], parameters)

    def find(self, grey: Image) -> Found:
        """What OpenCV finds."""
        corners, numbers, rejected, families = self._detector.detectMarkersMultiDict(grey)
        count = len(corners)
        return Found(
            np.array(corners, np.float64).reshape(count, 4, 2),
            np.array(numbers if count else [], np.int64).reshape(count),
            np.array(families if count else [], np.int64).reshape(count),
            len(rejected),
        )


def _codes(family: MarkerFamily, dictionary: cv2.aruco.Dictionary) -> NDArray[np.uint64]:
    """(M, 4) as `read_markers` takes them."""
    side = dictionary.markerSize
    if side * side > BITS:
        raise ParameterError(family, "dictionary", f"markers of up to {BITS} bits")
    bits = [cv2.aruco.Dictionary.getBitsFromByteList(code[None], side) for code in dictionary.bytesList]
    return np.array([[int("".join(map(str, np.rot90(b, turn).ravel())), 2) for turn in range(4)] for b in bits], np.uint64).reshape(-1, 4)
