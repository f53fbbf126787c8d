"""RGB-D visual odometry: the robot's motion since a keyframe from feature points whose depth the keyframe knows.

Points of the keyframe are followed into each image by optical flow from where the prediction puts them; where the prediction fails they
are found by their descriptors. Since every image is compared with the keyframe itself, errors add up from keyframe to keyframe only.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from slam.errors import require_positive
from slam.kernels.visual_pose import depths_at, pixels_of, placed, rays_of, refine
from slam.landmarks.features import Extractor, Found, OnnxFeatures, Orb, Sift, matched, spread
from slam.landmarks.marker_corners import lens_of
from slam.messages import RgbdImage
from slam.motion.keyframes import KeyframeGate
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3

LOSS = 6.0
"""Chi-square of a point (2 on average) at which it counts half."""
FITS = 12.0
"""Chi-square up to which a point is an inlier."""
FLOW = (15, 3)
"""Side of the flow's window [px] and levels of its pyramid."""
SHARED = 4.0
"""So many neighbouring points have one error: they share a surface, a patch of the depth image and a lens."""
SURPRISE = 22.5
"""Chi-square (0.1 % of 6 numbers) of a pose against its prediction beyond which it is not believed."""
HOPES = 200
"""Trials of three points when descriptors are matched."""
REACH = 4.0
"""How far from a pose a matched point may be seen then [px]."""
DOUBT = 3.0
LEAST = 1e-6
"""Information of what nothing is known of [1/m^2, 1/rad^2]."""
VAGUE = 1.0
"""Information of any prediction: the robot is within some metres and turns [1/m^2, 1/rad^2]."""
MEDIAN = 1.386
"""Of a chi-square of two numbers."""
WORST = 25.0
"""Largest scale of the chi-squares."""
BORDER = 8
"""Points so near to the image's border are not followed [px]."""
PATIENCE = 3
"""Images in a row that are not recognised, after which the next keyframe is made."""


@dataclass(frozen=True, slots=True)
class VisualOdometry:
    """How a camera's motion is found."""

    features: Literal["orb", "sift", "onnx"] = "orb"
    """Which points are followed."""
    orb: Orb = field(default_factory=Orb)
    sift: Sift = field(default_factory=Sift)
    onnx: OnnxFeatures = field(default_factory=OnnxFeatures)
    points: int = 200
    """Points of a keyframe that are followed, at most."""
    least: int = 20
    """Points that have to agree."""
    keyframes: KeyframeGate = field(default_factory=lambda: KeyframeGate(0.2, 0.2))
    """Motion after which an image becomes the next keyframe."""
    share: float = 0.5
    """Share of a keyframe's points below which the next one is due."""
    pixel: float = 0.15
    """Standard deviation of where a point is seen [px]."""
    depth: float = 0.004
    """Standard deviation of a depth of one metre [m]; it grows with the square of the depth."""
    depth_max: float = 6.0
    """Farthest depth that is used [m]."""
    tilt: float = 0.001
    """How far the robot may rise [m], pitch and roll [rad] between keyframes: it stands on a floor. 0.1 and more: a camera in the hand."""

    def __post_init__(self) -> None:
        require_positive(self, "points", "least", "share", "pixel", "depth", "depth_max", "tilt")

    def build(self) -> VisualTracker:
        """Make the tracker.

        Raises:
            FeatureNetworkError: the feature network cannot be read.
        """
        extractors = {"orb": self.orb, "sift": self.sift, "onnx": self.onnx}
        return VisualTracker(self, extractors[self.features].build())


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """Where the robot should be in the keyframe's base, from other sensors."""

    T_key_base: SE3
    information: FloatArray
    """(6, 6) of (translation, rotation vector) in base; 0: nothing is known."""
    twist: FloatArray
    """(3,) of base while the image was taken: v_x, v_y [m/s], omega [rad/s]; corrects the rolling shutter."""


@dataclass(frozen=True, slots=True, eq=False)
class VisualStep:
    """Where an image was taken."""

    key: int
    """Number of the keyframe."""
    T_key_base: SE3
    """Of base at the image's stamp in base at the keyframe's; the prediction where `seen` is False."""
    covariance: FloatArray
    """(6, 6) of (translation, rotation vector) in base, of all that is known [m, rad]."""
    information: FloatArray
    """(6, 6) of what the points alone tell; 0 where `seen` is False."""
    inliers: int
    seen: bool
    """Enough points agree, and they agree with the prediction."""
    renewed: bool
    """The image is the next keyframe: the next step is from here."""


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """An image that is being looked at."""

    image: RgbdImage
    grey: NDArray[np.uint8]
    T_base_camera: SE3
    twist: FloatArray
    """(3,) of base."""

    @property
    def mount(self) -> tuple[FloatArray, FloatArray]:
        """Rotation and translation of base from the camera."""
        return self.T_base_camera.R.copy(), self.T_base_camera.t.copy()

    def delays(self, pixels: FloatArray) -> FloatArray:
        """(N,) of the rows of pixels (N, 2) after the stamp [s]."""
        camera = self.image.colour_info
        return np.asarray((pixels[:, 1] - 0.5 * (camera.height - 1)) * camera.row_time, np.float64)

    def contains(self, pixels: FloatArray) -> NDArray[np.bool_]:
        """(N,) which of pixels (N, 2) are in the image, away from its border."""
        height, width = self.grey.shape
        u, v = pixels[:, 0], pixels[:, 1]
        return (u > BORDER) & (v > BORDER) & (u < width - 1 - BORDER) & (v < height - 1 - BORDER)


@dataclass(frozen=True, slots=True, eq=False)
class _Key:
    """A keyframe."""

    grey: NDArray[np.uint8]
    found: Found
    points: FloatArray
    """(N, 3) in base at the keyframe's stamp [m]."""
    errors: FloatArray
    """(N, 3) standard deviation of each, along its ray [m]."""


class VisualTracker:
    """Follows one camera; `number` counts its keyframes, the first is 0."""

    def __init__(self, settings: VisualOdometry, extractor: Extractor) -> None:
        self._settings, self._extractor = settings, extractor
        self._key: _Key | None = None
        self._misses = 0
        self._scale = 1.0  # of the chi-squares: how much worse points are seen than `pixel` and `depth` say
        self.number = -1

    def update(self, image: RgbdImage, mount: SE3, prediction: Prediction) -> VisualStep | None:
        """Where an image was taken; None for the first, which becomes the keyframe.

        Args:
            image: colour and depth.
            mount: `T_base_camera` of the colour camera.
            prediction: since the keyframe.
        """
        view = _View(image, np.asarray(cv2.cvtColor(image.colour, cv2.COLOR_RGB2GRAY), np.uint8), mount, prediction.twist)
        if self._key is None:
            self._renew(view)
            return None
        step = self._followed(self._key, view, prediction, prediction.T_key_base)
        if not step.seen:
            step = self._recognised(self._key, view, prediction) or step
        self._misses = 0 if step.seen else self._misses + 1
        if self._due(self._key, step):
            self._renew(view)
            return replace(step, renewed=True)
        return step

    def forget(self) -> None:
        """The next image is the first."""
        self._key = None

    def _due(self, key: _Key, step: VisualStep) -> bool:
        if not step.seen:
            return self._misses > PATIENCE or len(key.points) < self._settings.least
        few = step.inliers < max(self._settings.share * len(key.points), 2 * self._settings.least)
        return few or self._settings.keyframes.passes(SE2(), step.T_key_base.to_se2())

    def _renew(self, view: _View) -> None:
        """Make an image the keyframe."""
        s, camera, depth = self._settings, view.image.colour_info, view.image.depth_info
        found = self._extractor.find(view.grey)
        rays = rays_of(found.pixels, lens_of(camera))
        T_depth_colour = depth.T_base_camera.inverse() @ camera.T_base_camera
        depths = depths_at(rays, view.image.depth, lens_of(depth), (np.array(T_depth_colour.R), np.array(T_depth_colour.t)))
        known = np.flatnonzero(depths <= s.depth_max)
        chosen = known[spread(found.pixels[known], found.strengths[known], s.points)]
        pixels = found.pixels[chosen]
        points, directions = placed(rays[chosen], depths[chosen], view.delays(pixels), view.mount, view.twist)
        errors = directions * (s.depth * depths[chosen] ** 2)[:, None]
        self._key = _Key(view.grey, Found(pixels, found.descriptors[chosen], found.strengths[chosen]), points, errors)
        self.number += 1
        self._misses = 0

    def _followed(self, key: _Key, view: _View, prediction: Prediction, start: SE3) -> VisualStep:
        """The keyframe's points followed from where they are seen from `start`."""
        if len(key.points) < self._settings.least:
            return self._unseen(prediction)
        guess = pixels_of(key.points, (start.R.copy(), start.t.copy()), view.mount, lens_of(view.image.colour_info))
        there = np.flatnonzero(view.contains(guess))
        if len(there) < self._settings.least:
            return self._unseen(prediction)
        before, now = key.found.pixels[there].astype(np.float32), guess[there].astype(np.float32)
        side, levels = FLOW
        flow, status, _ = cv2.calcOpticalFlowPyrLK(
            key.grey, view.grey, before, now, winSize=(side, side), maxLevel=levels, flags=cv2.OPTFLOW_USE_INITIAL_FLOW
        )
        pixels = np.asarray(flow, np.float64).reshape(-1, 2)
        kept = np.flatnonzero((status.reshape(-1) == 1) & view.contains(pixels))
        return self._fitted(key, view, (there[kept], pixels[kept]), (prediction, start))

    def _recognised(self, key: _Key, view: _View, prediction: Prediction) -> VisualStep | None:
        """The keyframe's points found by their descriptors, and then followed."""
        s = self._settings
        found = self._extractor.find(view.grey)
        pairs = matched(key.found, found)
        if len(pairs) < s.least:
            return None
        camera = view.image.colour_info
        rays = rays_of(found.pixels[pairs[:, 1]], lens_of(camera))
        done, turn, shift, inliers = cv2.solvePnPRansac(
            key.points[pairs[:, 0]],
            rays,
            np.eye(3),
            None,
            iterationsCount=HOPES,
            reprojectionError=REACH / camera.K[0, 0],
            flags=cv2.SOLVEPNP_P3P,
        )
        if not done or len(inliers) < s.least:
            return None
        T_camera_key = SE3(np.asarray(cv2.Rodrigues(turn)[0], np.float64), np.asarray(shift, np.float64).reshape(3))
        return self._followed(key, view, prediction, (SE3(*view.mount) @ T_camera_key).inverse())

    def _fitted(self, key: _Key, view: _View, flow: tuple[NDArray[np.int64], FloatArray], from_: tuple[Prediction, SE3]) -> VisualStep:
        """The pose that the followed points and the prediction agree on."""
        s, (rows, pixels), (prediction, start) = self._settings, flow, from_
        if len(rows) < s.least:
            return self._unseen(prediction)
        camera, mean, trust = view.image.colour_info, prediction.T_key_base, SHARED * self._scale
        floor = np.diag([0.0, 0.0, 1.0, 1.0, 1.0, 0.0]) / s.tilt**2 + np.eye(6) * VAGUE
        seen = key.points[rows], key.errors[rows], rays_of(pixels, lens_of(camera)), view.delays(pixels)
        prior = (mean.R.copy(), mean.t.copy()), (prediction.information + floor) * trust
        noise = s.pixel / float(np.sqrt(camera.K[0, 0] * camera.K[1, 1])), LOSS * self._scale
        R, t, H, chi = refine((start.R.copy(), start.t.copy()), seen, (*view.mount, view.twist), prior, noise)
        T, fits = SE3(R, t), chi < FITS * self._scale
        inliers, information = int(fits.sum()), (0.5 / trust) * (H + H.T)
        covariance = np.linalg.inv(information + prediction.information + floor)
        step = VisualStep(self.number, T, 0.5 * (covariance + covariance.T), information, inliers, True, False)
        if inliers < s.least or 2 * inliers < len(rows) or _surprise(step, prediction) > SURPRISE:
            return self._unseen(prediction, inliers)
        spread_of = float(np.median(chi[fits])) / MEDIAN
        self._scale = min(max(0.9 * self._scale + 0.1 * spread_of, 1.0), WORST)
        return step

    def _unseen(self, prediction: Prediction, inliers: int = 0) -> VisualStep:
        covariance = np.asarray(np.linalg.inv(prediction.information + np.eye(6) * LEAST), np.float64)
        return VisualStep(self.number, prediction.T_key_base, covariance, np.zeros((6, 6)), inliers, False, False)


def _surprise(step: VisualStep, prediction: Prediction) -> float:
    """Chi-square of what the points alone say against the prediction, whose deviations are taken as `DOUBT` times as large."""
    weight = prediction.information / DOUBT**2
    away = (prediction.T_key_base.inverse() @ step.T_key_base).log()
    told = np.linalg.inv(step.information + np.eye(6) * LEAST)
    apart = np.linalg.inv(np.eye(6) + weight @ told)
    return float(away @ apart @ weight @ away)
