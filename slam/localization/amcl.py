"""The `amcl` pipeline: augmented Monte-Carlo localization that recovers, says how sure it is and is as exact as scan matching.

Thrun, Burgard, Fox, Probabilistic Robotics (2005), table 8.3; KLD sampling (Fox 2003); Gauss-Newton on the best mode.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from slam.errors import require_not_negative
from slam.localization.beam_model import BeamModel
from slam.localization.beams import apart, evenly, one_opinion_each
from slam.localization.belief import Belief, Filtering
from slam.localization.clusters import clusters_of
from slam.localization.health import NOT_HERE
from slam.localization.known_map import KnownMap
from slam.localization.landmarks import Landmarks
from slam.localization.matched_mode import MatchedMode
from slam.localization.mcl import without_wheels
from slam.localization.motion_models import ConstantVelocity, MotionModel, OdometryMotion, VelocityMotion
from slam.localization.particles import Particles
from slam.localization.places import trouble_at
from slam.localization.recovery import Recovery, Rung
from slam.localization.relocation import Relocation, View
from slam.localization.sensor_models import Likelihood, LikelihoodField, SensorModel
from slam.localization.whole_scan import FEWEST
from slam.matching.gauss_newton import GaussNewton
from slam.messages import Estimate, LaserScan, SensorFrame, Status
from slam.motion.ego_motion import EgoMotion
from slam.motion.keyframes import KeyframeGate
from slam.motion.motion_noise import MotionNoise
from slam.motion.scan_trajectory import ScanTrajectory
from slam.motion.sensor_watch import SensorWatch
from slam.scans import PointScan, Unveil
from slam.se2 import SE2, FloatArray
from slam.snapshot import Snapshot

_log = logging.getLogger(__name__)

LOOKED = 120
"""Most beams that weigh poses drawn about markers."""
HALF = 0.5
"""Share of a scan's beams that must get past what touches the robot."""


@dataclass(frozen=True, slots=True)
class Amcl:
    """Augmented MCL with KLD sampling, selective resampling, a recovery ladder and a polished estimate."""

    motion_model: Literal["odometry", "velocity"] = "odometry"
    odometry: OdometryMotion = field(default_factory=OdometryMotion)
    velocity: VelocityMotion = field(default_factory=VelocityMotion)
    drifting: ConstantVelocity = field(default_factory=ConstantVelocity)
    """Moves the particles of a robot without wheel odometry."""
    sensor_model: Literal["likelihood_field", "beam"] = "likelihood_field"
    likelihood_field: LikelihoodField = field(default_factory=LikelihoodField)
    beam: BeamModel = field(default_factory=BeamModel)
    filtering: Filtering = field(default_factory=Filtering)
    recovery: Recovery = field(default_factory=Recovery)
    update: KeyframeGate = field(default_factory=lambda: KeyframeGate(0.05, 0.1))
    """Motion after which the particles are updated; the spread of the motion models depends on it."""
    second_mode: float = 0.1
    """Share of the weight at which a second place makes the pose ambiguous."""
    polish: bool = True
    """Match each scan to the map from the best mode; the estimate is the mode's mean without."""
    matcher: GaussNewton = field(default_factory=GaussNewton)
    landmarks: Landmarks = field(default_factory=Landmarks)
    """Markers beside the scan."""
    unveil: Unveil = field(default_factory=Unveil)
    noise: MotionNoise = field(default_factory=MotionNoise)
    """How the estimate's covariance grows between scans."""
    start_position: float = 0.1
    """Standard deviation of the told start [m]."""
    start_yaw: float = 0.1
    """Standard deviation of the told start's heading [rad]."""
    seed: int = 0
    """Of the particles' random stream: the same seed gives the same bits."""

    def __post_init__(self) -> None:
        require_not_negative(self, "start_position", "start_yaw", "second_mode", "seed")

    def build(self, known_map: KnownMap, T_map_base: SE2 | None = None) -> AmclPipeline:
        """Make the pipeline; the robot starts near `T_map_base`, or anywhere in the map when it is None."""
        return AmclPipeline(self, known_map, T_map_base)

    @property
    def motion(self) -> MotionModel:
        """The motion model by its name."""
        return self.odometry if self.motion_model == "odometry" else self.velocity

    @property
    def sensor(self) -> SensorModel:
        """The sensor model by its name."""
        return self.likelihood_field if self.sensor_model == "likelihood_field" else self.beam


class AmclPipeline:
    """The estimate is the best mode, matched to the map; between scans odometry carries it."""

    def __init__(self, settings: Amcl, known_map: KnownMap, T_map_base: SE2 | None) -> None:
        self._settings = settings
        self._map = known_map
        self._picture = known_map.grid.frozen_copy()
        rng = np.random.default_rng(settings.seed)
        self._start_trouble = "the start is not known" if T_map_base is None else trouble_at(known_map, T_map_base)
        if T_map_base is not None and self._start_trouble:
            _log.warning("as a start, %s: it is looked for in the whole map", self._start_trouble)
        sizes = settings.filtering.sample_size
        if T_map_base is None or self._start_trouble:
            particles = Particles.anywhere(known_map, sizes.particles_max, rng)
        else:
            spread = np.diag([settings.start_position**2, settings.start_position**2, settings.start_yaw**2])
            particles = Particles.about(T_map_base, spread, sizes.particles_min, rng)
        self._belief = Belief(settings.filtering, known_map, particles, rng)
        self._ego = EgoMotion(settings.unveil, T_map_base or self._belief.modes[0].T_map_base)
        start = self._ego.T_map_base, particles.covariance(self._ego.T_map_base)
        self._mode = MatchedMode(known_map, settings.matcher if settings.polish else None, settings.noise, start)
        self._relocation = Relocation(settings.recovery, settings.second_mode, known_map, self._belief, self._mode)
        self._watch = SensorWatch()
        self._rng = rng
        self._landmarks = settings.landmarks.build()
        self._path = ScanTrajectory()
        self._likelihood: Likelihood | None = None
        self._health = 1.0
        self._way, self._duration = SE2(), 0.0  # since the last update of the particles
        self._step, self._reckoned = SE2(), SE2()  # to the newest scan, from the one before and from the first
        self._begun, self._blind = False, False

    def update(self, frame: SensorFrame) -> Estimate:
        """Take in one frame; answer with the pose at its stamp."""
        self._ego.hear(frame)
        if self._landmarks is not None:
            for image in frame.images:
                self._landmarks.look(image, self._ego)
        for scan in frame.scans:
            self._take(scan)
        return self._estimate(frame)

    def snapshot(self) -> Snapshot:
        """The map, the poses at scans, and the particles as the newest update has weighed them."""
        return Snapshot(self._picture, self._path.trajectory(), self._belief.weighed.as_rows())

    def _by_landmarks(self, scan: LaserScan, view: View) -> bool:
        """Where nothing is known, or markers contradict the pose: look for it where the markers say; whether that has led anywhere."""
        watch = self._landmarks
        if watch is None or not (self._start_trouble or self._relocation.ladder.lost or watch.contradicted):
            return False
        seen = watch.seen_at(scan.stamp, self._ego)
        if seen is None:
            return False
        poses, log_weights = watch.eye.seeds(self._map, seen, self._rng)
        if len(poses) == 0:
            return False
        self._likelihood = self._likelihood or self._settings.sensor.over(self._map, scan.range_max)
        chosen = evenly(view.cloud, LOOKED)
        log_weights = log_weights + self._likelihood.log(poses, chosen, one_opinion_each(chosen.points, self._settings.filtering.patch))
        best = [mode.T_map_base for mode in clusters_of(Particles(poses, log_weights)) if mode.weight >= self._settings.second_mode]
        found = self._settings.recovery.search.follow(self._map, best, *view.beams)
        places = [place for place in found if not watch.eye.contradicts(place.T_map_base, seen)]
        if places:
            self._relocation.take_up(places, sure=len(places) == 1)
            self._start_trouble = ""
            watch.believe()
        return bool(places)

    def _take(self, scan: LaserScan) -> None:
        seen, by_wheels, step = self._ego.points(scan), self._ego.wheels_cover(scan.stamp), self._ego.step(scan.stamp)
        before = self._ego.T_map_base
        self._step, self._reckoned = step, self._reckoned @ step
        self._way, self._duration = self._way @ step, self._duration + max(self._ego.since(scan.stamp), 0.0)
        self._mode.carry(before, step)
        cloud = apart(seen)
        self._blind = len(cloud.points) < max(FEWEST, HALF * len(seen.points))
        pose, jumped = before @ step, False
        if not self._blind:
            self._relocation.ladder.trust.follow(cloud.points, self._reckoned)
            pose, jumped = self._localise(scan, cloud, by_wheels)
        self._ego.settle(scan.stamp, pose, jumped)
        self._path.append(scan.stamp, pose)

    def _localise(self, scan: LaserScan, cloud: PointScan, by_wheels: bool) -> tuple[SE2, bool]:
        """The pose of a scan, and whether it is not where the one before leads to."""
        relocation, view = self._relocation, View.of(scan, cloud)
        jumped = self._by_landmarks(scan, view)
        if self._start_trouble and relocation.ladder.search(scan.stamp) == Rung.SEARCH:
            jumped = relocation.begin(view)
            self._start_trouble = "" if jumped else self._start_trouble
        if jumped:
            self._way, self._duration = SE2(), 0.0
        if not self._begun or not by_wheels or self._settings.update.passes(SE2(), self._way):
            self._filter(scan, cloud, by_wheels)
        pose = self._mode.match(cloud.points)
        here = relocation.judge(pose, view)
        if relocation.recover(view, here, self._step, self._reckoned):
            jumped, self._way, self._duration = True, SE2(), 0.0
            pose = self._mode.match(cloud.points)
            here = relocation.judge(pose, view)
        self._health = here.explained
        return pose, jumped

    def _filter(self, scan: LaserScan, cloud: PointScan, by_wheels: bool) -> None:
        s = self._settings
        if self._likelihood is None:
            self._likelihood = s.sensor.over(self._map, scan.range_max)
        if s.sensor_model == "beam":  # for which it counts, too, that a beam meets nothing
            returned = np.where(np.isposinf(scan.ranges), scan.range_max, scan.ranges)
            cloud = apart(self._ego.points(replace(scan, ranges=returned)))
        markers = self._landmarks.weigh(scan.stamp, self._ego) if self._landmarks else None
        self._belief.update(s.motion if by_wheels else s.drifting, (self._way, self._duration), self._likelihood, cloud, markers)
        self._way, self._duration, self._begun = SE2(), 0.0, True
        self._mode.follow(self._belief.modes[0])

    def _estimate(self, frame: SensorFrame) -> Estimate:
        step = self._ego.step(frame.stamp)
        pose = self._ego.T_map_base @ step
        covariance: FloatArray = self._settings.noise.propagate(self._mode.covariance, self._ego.T_map_base, step)
        status, reason = self._standing(frame, pose)
        return Estimate(frame.stamp, pose, pose @ self._ego.motion.wheels.inverse(), covariance, status, self._health, reason)

    def _standing(self, frame: SensorFrame, pose: SE2) -> tuple[Status, str]:
        """Status and its reason."""
        silent = self._watch.silent(frame)
        if self._start_trouble:
            return Status.LOST, self._start_trouble
        if self._relocation.ladder.lost:
            return Status.LOST, NOT_HERE
        modes = self._relocation.likely_modes
        if len(modes) > 1:
            return Status.AMBIGUOUS, f"{len(modes)} places are possible: {', '.join(map(str, modes))}"
        doubts = "the scan fits the map badly" if self._relocation.ladder.watch.doubtful else ""
        blind = "the scan shows nothing" if self._blind else ""
        camera = self._landmarks.trouble(frame) if self._landmarks else ""
        reasons = silent, without_wheels(self._ego, frame), blind, doubts, trouble_at(self._map, pose), camera
        reason = "; ".join(reason for reason in reasons if reason)
        return (Status.DEGRADED if reason else Status.TRACKING), reason
