"""ArUco and AprilTag markers in images: which, where their corners are below the pixel, and both poses that each may have."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from slam.errors import ParameterError, SlamError, require_not_negative, require_positive
from slam.kernels.planar_pose import square_poses
from slam.kernels.rolling_shutter import read_at_once
from slam.landmarks.camera_info_file import read_camera_info, with_intrinsics
from slam.landmarks.marker_corners import CornerMethod, as_found, fit_lines
from slam.landmarks.marker_family import MarkerFamily
from slam.landmarks.marker_search import OPENCV, Found, MarkerSearch, OpenCvSearch, OwnSearch, Tolerance
from slam.landmarks.sighting import Sighting
from slam.messages import CameraInfo
from slam.se2 import FloatArray
from slam.se3 import SE3

Image = NDArray[np.uint8]
STILL = np.zeros(3)


class MarkerImageError(SlamError):
    """An image in which no marker can be measured, because it does not fit its camera."""


@dataclass(frozen=True, slots=True)
class Markers:
    """What markers there are and how they are found."""

    families: tuple[MarkerFamily, ...] = (MarkerFamily(),)
    """Dictionaries and sizes."""
    camera_info: str = ""
    """CameraInfo YAML of `twin calibrate camera` whose K and distortion are taken; none: those that come with the images."""
    corners: CornerMethod = "lines"
    """`lines`, our own search and edges; `none`, `subpix`, `contour`, `apriltag`: OpenCV's detector and corners, for comparison."""
    quick: bool = False
    """Look once, unless that finds nothing: for films. Otherwise also for paler and for blurred markers, in the picture made smaller."""
    error_correction: float = 0.3
    """Share of the bits that a dictionary can correct which is corrected; more finds markers where there are none."""
    least_side: float = 12.0
    """Shortest mean side [px]."""
    worst_line: float = 0.5
    """Largest RMS of the residuals of a marker's edges [px]."""
    least_contrast: float = 8.0
    """Of an edge [grey levels]."""
    worst_blur: float = 0.4
    """Largest blur, as a share of a module: beyond it neighbouring edges run into each other."""

    def __post_init__(self) -> None:
        require_positive(self, "least_side", "worst_line", "worst_blur")
        require_not_negative(self, "error_correction", "least_contrast")
        if not self.families:
            raise ParameterError(self, "families", "one family at least")
        methods = ("lines", *OPENCV)
        if self.corners not in methods:
            raise ParameterError(self, "corners", f"one of {', '.join(methods)}")

    def build(self) -> MarkerDetector:
        """Make the detector.

        Raises:
            ParameterError: a dictionary that there is not.
            CameraInfoFileError: the camera's file cannot be read.
        """
        return MarkerDetector(self)


@dataclass(frozen=True, slots=True, eq=False)
class Detection:
    """What one image shows."""

    sightings: tuple[Sighting, ...]
    """By rising id."""
    rejected: Counter[str]
    """Reason -> how many were seen and not used.

    `not decoded`, `twice`, `too small`, `no edges`, `poor edges`, `blurred`, `pale`, `no pose`.
    """


class MarkerDetector:
    """Finds markers; keeps nothing from image to image."""

    def __init__(self, settings: Markers) -> None:
        self.settings = settings
        self._calibrated = read_camera_info(Path(settings.camera_info)) if settings.camera_info else None
        self._modules = np.array([family.load().markerSize + 2.0 for family in settings.families])
        tolerance = Tolerance(settings.error_correction, settings.least_side, settings.least_contrast)
        self._search: MarkerSearch = (
            OwnSearch(settings.families, tolerance, quick=settings.quick)
            if settings.corners == "lines"
            else OpenCvSearch(settings.families, tolerance, settings.corners)
        )

    def detect(self, image: Image, camera: CameraInfo, twist: FloatArray = STILL) -> Detection:
        """Find the markers of an image.

        Args:
            image: (H, W) grey or (H, W, 3) red, green, blue.
            camera: that took it.
            twist: (3,) of base in base while it was taken: v_x, v_y [m/s], omega [rad/s]; corrects the rolling shutter.

        Raises:
            MarkerImageError: the camera's K is missing or of another resolution.
        """
        camera = with_intrinsics(camera, self._calibrated) if self._calibrated else camera
        require_camera(image, camera)
        grey = np.ascontiguousarray(image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8)
        found = self._search.find(grey)
        rejected = Counter({"not decoded": found.undecoded} if found.undecoded else {})
        firsts = np.array([family.first for family in self.settings.families], dtype=np.int64)
        ids = found.numbers + firsts[found.families]
        once = _once(ids, rejected)
        return self._measured(grey, camera, twist, (found.only(once), ids[once]), rejected)

    def _measured(
        self, grey: Image, camera: CameraInfo, twist: FloatArray, seen: tuple[Found, NDArray[np.int64]], rejected: Counter[str]
    ) -> Detection:
        found, ids = seen
        modules, sides = self._modules[found.families], _sides(found.corners)
        which = zip(found.families.tolist(), found.numbers.tolist(), strict=True)
        sizes = np.array([self.settings.families[family].size_of(number) for family, number in which], np.float64)
        method = self.settings.corners
        fitted = fit_lines(grey, found.corners, modules, camera) if method == "lines" else as_found(found.corners, method, camera)
        rays, pixels, covariances, quality = fitted
        good = [n for n in range(len(ids)) if not _counted(rejected, self._fault(sides[n], quality[n], modules[n]))]
        order = np.array(sorted(good, key=lambda n: int(ids[n])), dtype=np.int64)
        rays, covariances, sizes = rays[order], covariances[order], sizes[order]
        rays, poses = _poses(rays, covariances, sizes, (camera, pixels[order], twist))
        R, t, chi = poses
        sightings: list[Sighting] = []
        for k, n in enumerate(order.tolist()):
            if _counted(rejected, "" if np.isfinite(chi[k]).all() else "no pose"):
                continue
            branches = SE3(R[k, 0], t[k, 0]), SE3(R[k, 1], t[k, 1])
            chi2 = float(chi[k, 0]), float(chi[k, 1])
            sightings.append(
                Sighting(
                    int(ids[n]), float(sizes[k]), pixels[n], rays[k], covariances[k], branches, chi2, float(sides[n]), float(quality[n, 2])
                )
            )
        return Detection(tuple(sightings), rejected)

    def _fault(self, side: float, quality: FloatArray, modules: float) -> str:
        """Why a marker is not used; empty when it is."""
        rms, contrast, blur = quality.tolist()
        s = self.settings
        faults = {
            "too small": side < s.least_side,
            "no edges": not np.isfinite(rms),
            "pale": contrast < s.least_contrast,
            "blurred": blur > s.worst_blur * side / modules,
            "poor edges": rms > s.worst_line,
        }
        return next((name for name, is_so in faults.items() if is_so), "")


def require_camera(image: Image, camera: CameraInfo) -> None:
    """Check that the camera can have taken the image.

    Raises:
        MarkerImageError: its K is missing or of another resolution.
    """
    height, width = image.shape[:2]
    if not (camera.K[0, 0] > 0.0 and camera.K[1, 1] > 0.0):
        raise MarkerImageError(f"the camera has no K (focal lengths {camera.K[0, 0]:g}, {camera.K[1, 1]:g}); calibrate it")
    if (width, height) != (camera.width, camera.height):
        raise MarkerImageError(
            f"the image is {width} x {height}, its K is for {camera.width} x {camera.height}: {width / camera.width:.3g} times as wide; "
            "give the K of this resolution"
        )


def _once(ids: NDArray[np.int64], rejected: Counter[str]) -> NDArray[np.int64]:
    """Places of the ids that are there once."""
    counts: Counter[int] = Counter(ids.tolist())
    once = [n for n, marker in enumerate(ids.tolist()) if counts[marker] == 1]
    if len(once) < len(ids):
        rejected["twice"] += len(ids) - len(once)
    return np.array(once, dtype=np.int64)


def _counted(rejected: Counter[str], fault: str) -> bool:
    if fault:
        rejected[fault] += 1
    return bool(fault)


def _sides(corners: FloatArray) -> FloatArray:
    """Mean lengths (N,) of the sides [px]."""
    return np.hypot(*np.moveaxis(np.roll(corners, -1, axis=1) - corners, 2, 0)).mean(axis=1)


def _poses(
    rays: FloatArray, covariances: FloatArray, sizes: FloatArray, seen: tuple[CameraInfo, FloatArray, FloatArray]
) -> tuple[FloatArray, tuple[FloatArray, FloatArray, FloatArray]]:
    """Rays at the image's stamp and both poses of each square."""
    camera, pixels, twist = seen
    weights = np.asarray(np.linalg.inv(covariances), dtype=np.float64)
    if camera.row_time > 0.0 and np.any(twist):
        R, t, _ = square_poses(rays, weights, sizes, 0)
        mount = np.array(camera.T_base_camera.R), np.array(camera.T_base_camera.t)
        delays = (pixels[:, :, 1] - 0.5 * (camera.height - 1)) * camera.row_time
        rays = read_at_once(rays, (R[:, 0], t[:, 0]), mount, twist, delays)
    return rays, square_poses(rays, weights, sizes)
