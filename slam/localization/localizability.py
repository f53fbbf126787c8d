"""The `localizability` pipeline: document C. Monte-Carlo localization that knows which beams people and moved things spoil.

1. People in the colour and depth image, by HOG.
2. Their spans as bearings of the lidar: q.
3. Influence factors s of the beams, from q and from what the map expects at the mean of the predicted set.
4. Dynamic localizability matrix D.
5. Fusion: particles weighed by the beams that are left (`weighted`), or the document's equation 14.

Without a camera the map alone tells people from walls, with 5 % of all beams taken to meet somebody.
"""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np

from slam.errors import ParameterError, require_not_negative, require_positive
from slam.landmarks.people import PeopleDetector
from slam.localization.beams import evenly
from slam.localization.fusion_eq14 import fused, gain, moved_along
from slam.localization.influence import Influence, localizability_matrix
from slam.localization.known_map import KnownMap
from slam.localization.map_faces import MapFaces, Sight
from slam.localization.mcl import GaussianField, Mcl, MclPipeline
from slam.localization.motion_models import ConstantVelocity, OdometryMotion
from slam.localization.particles import Particles
from slam.localization.people_around import Carrying, PeopleAround
from slam.localization.resampling import parents
from slam.localization.seen_directions import SeenDirections
from slam.localization.sensor_models import require_shares
from slam.messages import Estimate, SensorFrame, Status
from slam.scans import PointScan
from slam.se2 import SE2, FloatArray
from slam.snapshot import Snapshot

_log = logging.getLogger(__name__)

Fusion = Literal["weighted", "eq14"]

FEWEST = 5.0
"""Beams on what the map knows below which a scan says too little."""
LEAST_POWER = 2.0**-24
"""Of the weights: equal weights, but for places that differ by thousands of beams."""
HALVINGS = 10
"""Of the octaves between that and 1, in search of the weights' power."""
CAMERA_PATIENCE = 1.0
"""Silence of a camera that is named [s]."""
BLIND = "people are told from walls by the map alone"


@dataclass(frozen=True, slots=True)
class Localizability(Mcl):
    """Localization by those beams of the lidar that can be trusted."""

    motion: OdometryMotion = field(default_factory=lambda: OdometryMotion(0.003, 0.003, 0.001, 0.001))
    sensor: GaussianField = field(default_factory=lambda: GaussianField(sigma_hit=0.05))
    beams: int = 120
    fusion: Fusion = "weighted"
    """How D is used: weighted beams, or equation 14 of the document after unweighted ones."""
    tempering: float = 0.5
    """kappa: beams are not independent, and count so much each."""
    effective_min: float = 0.3
    """Share of particles that a scan leaves with weight: while they are spread wide, few would be near the best pose and none at it."""
    k1: float = 1.0
    """Weight of odometry in equation 14."""
    influence: Influence = field(default_factory=Influence)
    people: PeopleDetector = field(default_factory=PeopleDetector)
    carrying: Carrying = field(default_factory=Carrying)

    def __post_init__(self) -> None:
        Mcl.__post_init__(self)
        require_positive(self, "tempering")
        require_shares(self, "effective_min")
        require_not_negative(self, "k1")
        if self.fusion not in get_args(Fusion):
            raise ParameterError(self, "fusion", f"one of {', '.join(get_args(Fusion))}")

    def build(self, known_map: KnownMap, T_map_base: SE2 | None = None) -> LocalizabilityPipeline:
        """Make the pipeline; the robot starts near `T_map_base`, or anywhere in the map when it is None."""
        return LocalizabilityPipeline(self, known_map, T_map_base)


class LocalizabilityPipeline(MclPipeline):
    """The classic filter with another way to weigh."""

    def __init__(self, settings: Localizability, known_map: KnownMap, T_map_base: SE2 | None) -> None:
        super().__init__(settings, known_map, T_map_base)
        self._chosen = settings
        self._faces = MapFaces(known_map)
        self._people = PeopleAround(settings.carrying)
        self._pictured = -math.inf  # stamp of the newest picture
        self._matrix: FloatArray = np.zeros((3, 3))

    def update(self, frame: SensorFrame) -> Estimate:
        """Take in one frame; answer with the pose at its stamp."""
        estimate = super().update(frame)
        for image in frame.images:  # they arrive later than the scans of the same frame, and serve the next ones
            self._people.see(self._chosen.people.detect(image), self._ego.motion.pose_at(image.stamp))
            self._pictured = image.stamp
        without = self._without_camera(frame)
        reason = "; ".join(reason for reason in (estimate.reason, without) if reason)
        return replace(
            estimate, reason=reason, status=Status.DEGRADED if without and estimate.status is Status.TRACKING else estimate.status
        )

    def snapshot(self) -> Snapshot:
        """As of `MclPipeline`, with D of the newest update."""
        return replace(super().snapshot(), localizability=self._matrix)

    def _filter(self, cloud: PointScan, range_max: float, by_wheels: bool) -> SE2:
        s = self._chosen
        if self._likelihood is None:
            self._likelihood = s.sensor.over(self._map, range_max)
        motion = s.motion if by_wheels else ConstantVelocity()
        predicted = Particles.equal(motion.sample(self._particles.poses, self._way, self._duration, self._rng))
        P_odo = predicted.mean()
        C = predicted.covariance(P_odo)
        cloud = evenly(cloud, s.beams)
        sight = self._faces.look(P_odo, cloud, range_max)
        kept = s.tempering * (1.0 - self._factors(cloud, sight, C, range_max))
        self._matrix = localizability_matrix(sight, kept * (sight.cosines / s.sensor.sigma_hit) ** 2)
        shares = kept if s.fusion == "weighted" else np.full(len(kept), s.tempering)
        directions = SeenDirections.of(self._matrix, C, s.tempering / s.sensor.sigma_hit**2)
        judged = directions.level(predicted.poses, P_odo) if s.fusion == "weighted" else predicted.poses
        weighed = _softened(Particles(predicted.poses, self._likelihood.log(judged, cloud, shares)), s.effective_min)
        P_PF = weighed.mean()
        mean = directions.fuse(P_odo, P_PF, C) if s.fusion == "weighted" else fused(P_odo, P_PF, gain(self._matrix, C, s.k1))
        poses = moved_along(predicted.poses, mean, P_PF)
        self._covariance = Particles(poses, weighed.log_weights).covariance(mean)
        drawn = Particles.equal(poses[parents(weighed.weights, len(poses), self._rng)])
        self._particles = Particles.equal(moved_along(drawn.poses, mean, drawn.mean()))
        self._way, self._duration, self._begun = SE2(), 0.0, True
        self._judge(kept / s.tempering)
        return mean

    def _factors(self, cloud: PointScan, sight: Sight, C: FloatArray, range_max: float) -> FloatArray:
        """Influence factors s (M,)."""
        T_odom_base = self._ego.motion.pose_at(cloud.stamp)
        seen = self._people.probabilities(cloud.origins, cloud.points, T_odom_base, cloud.stamp)
        ranges = np.hypot(*(cloud.points - cloud.origins).T)
        return self._chosen.influence.factors(ranges, sight, C, seen, range_max)

    def _judge(self, trusted: FloatArray) -> None:
        """How far the scan supports the pose, by the probabilities (M,) that beams end on what the map knows."""
        self._health = float(trusted.mean())
        if trusted.sum() < FEWEST:
            self._trouble = f"only {trusted.sum():.0f} of {len(trusted)} beams see what the map knows"

    def _without_camera(self, frame: SensorFrame) -> str:
        """That the camera is silent, if so; that the body has none is said once, and is no fault."""
        if self._pictured == -math.inf:
            self._pictured = frame.stamp
            if "images" not in frame.available:
                _log.warning("no camera: %s", BLIND)
        silent = "images" in frame.available and frame.stamp - self._pictured > CAMERA_PATIENCE
        return f"silent: camera; {BLIND}" if silent else ""


def _softened(particles: Particles, effective_min: float) -> Particles:
    """Weights to the highest power, at most 1, that leaves so large a share of the particles effective: annealed importance sampling."""
    low, high = LEAST_POWER, 1.0
    if particles.effective >= effective_min * len(particles):
        return particles
    for _ in range(HALVINGS):
        middle = math.sqrt(low * high)
        enough = replace(particles, log_weights=middle * particles.log_weights).effective >= effective_min * len(particles)
        low, high = (middle, high) if enough else (low, middle)
    return replace(particles, log_weights=low * particles.log_weights)
