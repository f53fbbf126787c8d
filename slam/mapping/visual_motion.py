"""How the robot moves from image to image, by camera, wheels and gyro: as many of them as there are."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from slam.landmarks.marker_graph import Told
from slam.landmarks.odometry_scales import OdometryScales
from slam.landmarks.visual_odometry import Prediction, VisualOdometry, VisualStep
from slam.mapping.uncertainty import composed, from_body, to_body
from slam.messages import RgbdImage
from slam.motion.ego_motion import EgoMotion
from slam.motion.motion_noise import MotionNoise
from slam.scans import Unveil
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3

LEAST = 1e-8
"""Variance of any step [m^2, rad^2]."""
PLANAR = np.ix_([0, 1, 5], [0, 1, 5])
"""What of (translation, rotation vector) moves on the floor."""
SWERVE = np.array([0.5, 0.2, 1.0])
"""Standard deviation of a robot's change of (v_x, v_y, omega) from image to image, where no wheels tell of it [m/s, rad/s]."""
NOTHING = np.zeros((3, 3))


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """Where an image is, by way of the camera's keyframe."""

    T_a_key: SE2
    covariance: FloatArray
    """(3, 3) of it, of the body."""
    seen: bool = True
    """The camera has followed all of it."""

    @classmethod
    def ending(cls, T_a_now: SE2, covariance: FloatArray, T_key_now: SE2) -> Leg:
        """A leg after which the present is there, with a covariance (3, 3) of the body."""
        back = T_key_now.inverse()
        return cls(T_a_now @ back, composed(covariance, back, NOTHING))

    def to(self, T_key_now: SE2, covariance: FloatArray) -> tuple[SE2, FloatArray]:
        """Where the present is, and its covariance (3, 3) of the body."""
        return self.T_a_key @ T_key_now, composed(self.covariance, T_key_now, covariance)


class VisualMotion:
    """Pose in the map and its covariance at the newest image; what else tells of the pose puts it right by `correct`."""

    def __init__(self, settings: VisualOdometry, noise: MotionNoise, unveil: Unveil, T_map_base: SE2) -> None:
        self._noise = noise
        self._tracker = settings.build()
        self.ego = EgoMotion(unveil, T_map_base)
        self.scales = OdometryScales()
        """Of what wheels and gyro say."""
        self.T_map_base = T_map_base
        """At the newest image."""
        self.covariance: FloatArray = NOTHING
        """(3, 3) of it, in the map."""
        self.visual: VisualStep | None = None
        """What the camera said of the newest image; None before the second."""
        self.stamp = -np.inf
        """Of the newest image [s]."""
        self._begun = np.inf  # when a pose was first asked for [s]
        self._since_key = SE2()
        self._in_map = Leg(T_map_base, NOTHING)
        self._marks: dict[str, Leg] = {}

    @property
    def seeing(self) -> bool:
        """Whether the camera told how the robot moved to the newest image."""
        return self.visual is not None and self.visual.seen

    def step_to(self, stamp: float) -> SE2:
        """What the robot has moved since the newest image, by wheels and gyro put right by `scales`, without them as it did before."""
        return self.scales.corrected(self.ego.step(stamp)) if self.ego.wheels_cover(stamp) else self.ego.step(stamp)

    def at(self, stamp: float) -> tuple[SE2, FloatArray]:
        """`T_map_base` at a time [s] and its covariance (3, 3) in the map."""
        step = self.step_to(stamp)
        covariance = self._noise.propagate(self.covariance, self.T_map_base, step)
        if not self.ego.wheels_cover(stamp):
            self._begun = min(self._begun, stamp)
            covariance = covariance + np.diag(self._swerve(max(stamp - max(self.stamp, self._begun), 0.0)))
        return self.T_map_base @ step, covariance

    def see(self, image: RgbdImage, mount: SE3, *, rest: bool = False) -> None:
        """Go on to an image, with the camera at `T_base_camera` mount; at `rest` by wheels and gyro alone, which is faster."""
        prediction, step = self._predicted(image.stamp)
        T_before, self.T_map_base = self.T_map_base, self.T_map_base @ step
        if rest:
            self._tracker.forget()
        self.visual = None if rest else self._tracker.update(image, mount, prediction)
        if self.visual is None:
            self.covariance = self._noise.propagate(self.covariance, T_before, step)
            self._in_map = Leg(self.T_map_base, to_body(self.covariance, self.T_map_base))
            self._marks = {name: Leg(leg.T_a_key @ self._since_key @ step, leg.covariance, False) for name, leg in self._marks.items()}
            self._since_key = SE2()
        else:
            self._moved(self.visual)
        self.stamp = image.stamp
        self.ego.settle(image.stamp, self.T_map_base)

    def correct(self, T_map_base: SE2, covariance: FloatArray) -> None:
        """The newest image was taken here, with a covariance (3, 3) in the map."""
        self.T_map_base, self.covariance = T_map_base, covariance
        self._in_map = Leg.ending(T_map_base, to_body(covariance, T_map_base), self._since_key)
        self.ego.settle(self.stamp, T_map_base)

    def told(self, name: str) -> Told | None:
        """The step to the newest image since this was last asked by that name, as camera, wheels and gyro together tell of it.

        None the first time, and where the camera has not seen all of it.
        """
        leg, visual = self._marks.get(name), self.visual
        self._marks[name] = Leg.ending(SE2(), NOTHING, self._since_key)
        if leg is None or not leg.seen:
            return None
        own = NOTHING if visual is None or visual.renewed else visual.covariance[PLANAR]
        step, covariance = leg.to(self._since_key, own)
        return Told(step, np.asarray(np.linalg.inv(from_body(covariance, step) + np.eye(3) * LEAST), np.float64))

    def _moved(self, visual: VisualStep) -> None:
        """Take what camera and prediction agree on."""
        T_key_now, covariance = visual.T_key_base.to_se2(), visual.covariance[PLANAR]
        self.T_map_base, body = self._in_map.to(T_key_now, covariance)
        self.covariance = from_body(body, self.T_map_base)
        self._since_key = T_key_now
        if not visual.seen:
            self._marks = {name: replace(leg, seen=False) for name, leg in self._marks.items()}
        if visual.renewed:
            self._in_map = Leg(self.T_map_base, body)
            self._marks = {name: Leg(*leg.to(T_key_now, covariance), leg.seen) for name, leg in self._marks.items()}
            self._since_key = SE2()

    def _predicted(self, stamp: float) -> tuple[Prediction, SE2]:
        """Where the robot should be in the keyframe's base, and the step since the image before."""
        step = self.step_to(stamp)
        T_key_now, duration = self._since_key @ step, max(stamp - self.stamp, 0.0) if np.isfinite(self.stamp) else 1.0
        if self.ego.wheels_cover(stamp):
            covariance = self._noise.covariance(T_key_now) + np.eye(3) * LEAST
        else:
            covariance = np.diag(self._swerve(duration) + LEAST)
        information = np.zeros((6, 6))
        information[PLANAR] = np.linalg.inv(covariance)
        return Prediction(SE3.from_se2(T_key_now), information, self.ego.twist(stamp)), step

    def _swerve(self, duration: float) -> FloatArray:
        return np.asarray((SWERVE * duration) ** 2, np.float64)
