"""The particle filter of `amcl`: Thrun, Burgard, Fox, Probabilistic Robotics (2005), table 8.3, step by step."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from slam.errors import require_not_negative
from slam.kernels.particle_weights import mean_likelihood
from slam.localization.augmentation import Augmentation, Averages
from slam.localization.beams import evenly, one_opinion_each
from slam.localization.clusters import Cluster, clusters_of
from slam.localization.global_search import Hypothesis
from slam.localization.known_map import KnownMap
from slam.localization.motion_models import MotionModel
from slam.localization.particles import Particles, anywhere
from slam.localization.resampling import Kld
from slam.localization.sensor_models import Likelihood
from slam.scans import PointScan
from slam.se2 import SE2, FloatArray

Weigh = Callable[[FloatArray], FloatArray]
"""From poses (N, 3) to log-likelihoods (N,)."""
SEED_POSITION, SEED_YAW = 0.05, 0.05
"""Standard deviations about a place that a search has found [m, rad]."""
KEPT = 0.2
"""Share of the old particles that remain when a search finds several places."""


@dataclass(frozen=True, slots=True)
class Filtering:
    """How particles are weighed and drawn."""

    beams: int = 0
    """Most beams that weigh a particle, evenly spread over the valid ones; 0 takes all."""
    patch: float = 0.2
    """Beams that end in one square of this side count together as one, for the map's errors there are theirs in common; 0 counts
    each as one [m]."""
    sample_size: Kld = field(default_factory=Kld)
    resample_below: float = 0.5
    """Share of the particles below which N_eff calls for resampling; 1 resamples at every update."""
    augmentation: Augmentation = field(default_factory=Augmentation)

    def __post_init__(self) -> None:
        require_not_negative(self, "beams", "patch", "resample_below")


class Belief:
    """Where the robot may be."""

    def __init__(self, settings: Filtering, known_map: KnownMap, particles: Particles, rng: np.random.Generator) -> None:
        self._settings = settings
        self._map = known_map
        self._rng = rng
        self.particles = particles
        """As they go into the next update."""
        self.weighed = particles
        """As the newest scan has weighed them, before the draw."""
        self.modes: tuple[Cluster, ...] = clusters_of(particles)
        """At the newest update, the heaviest first."""
        self.averages = Averages(settings.augmentation)
        self.doubtful = False
        """Whether the newest scans do not support the pose: only then random poses are drawn."""

    def update(
        self, motion: MotionModel, way: tuple[SE2, float], likelihood: Likelihood, cloud: PointScan, beside: Weigh | None = None
    ) -> None:
        """Algorithm Augmented_MCL: sample the motion, weigh, average, draw.

        Args:
            motion: its model.
            way: T_before_after and the time that it took [s].
            likelihood: the sensor model in the map.
            cloud: a scan with one valid beam at least, deskewed.
            beside: log-likelihoods of what else is seen; the average is of the scan's alone.
        """
        poses = motion.sample(self.particles.poses, *way, self._rng)
        chosen = evenly(cloud, self._settings.beams)
        weights = one_opinion_each(chosen.points, self._settings.patch)
        log_likelihoods = likelihood.log(poses, chosen, weights)
        log_weights = self.particles.log_weights + log_likelihoods
        self.weighed = Particles(poses, log_weights if beside is None else log_weights + beside(poses))
        self.averages.add(mean_likelihood(self.particles.weights, log_likelihoods, 1.0 / float(weights.sum())))
        self.modes = clusters_of(self.weighed)
        self._draw()

    def expand(self, position: float, yaw: float) -> None:
        """Spread the particles by normal noise of these standard deviations [m, rad]."""
        noise = self._rng.standard_normal((len(self.particles), 3)) * (position, position, yaw)
        self.particles = Particles(self.particles.poses + noise, self.particles.log_weights)

    def seed(self, places: Sequence[Hypothesis]) -> None:
        """Draw particles where a search has found the scan: by their odds, all of them when there is one place only."""
        self.averages.forget()
        sizes = self._settings.sample_size
        if not places:
            self.particles = Particles.equal(anywhere(self._map, sizes.particles_max, self._rng))
            return
        total = sizes.particles_min if len(places) == 1 else sizes.particles_max
        kept = 0 if len(places) == 1 else min(round(KEPT * total), len(self.particles))
        odds = np.exp(np.array([place.score - places[0].score for place in places]))
        counts = np.maximum(np.round((total - kept) * odds / odds.sum()).astype(np.int64), 1)
        floor = np.diag([SEED_POSITION**2, SEED_POSITION**2, SEED_YAW**2])
        drawn: list[FloatArray] = [
            Particles.about(place.T_map_base, place.covariance + floor, int(count), self._rng).poses
            for place, count in zip(places, counts, strict=True)
        ]
        old = self.particles.poses[self._rng.choice(len(self.particles), kept, replace=False)]
        self.particles = self.weighed = Particles.equal(np.concatenate([*drawn, old]))
        self.modes = clusters_of(self.particles)

    def _draw(self) -> None:
        """Selective resampling, with a share of random poses when the likelihood falls (table 8.3, lines 10 to 16).

        The likelihood falls, too, where a well mapped room ends and clutter begins; random poses among which one is likely by chance
        would then end a track that is all right.
        """
        particles, share = self.weighed, self.averages.share if self.doubtful else 0.0
        added = round(share * len(particles))
        if added == 0 and particles.effective >= self._settings.resample_below * len(particles):
            self.particles = particles
            return
        drawn = self._settings.sample_size.draw(particles, self._rng)
        added = min(math.ceil(share * len(drawn)) if added else 0, len(drawn))
        poses = particles.poses.take(drawn, axis=0)
        if added:
            kept = self._rng.choice(len(drawn), len(drawn) - added, replace=False)
            poses = np.concatenate([poses[np.sort(kept)], anywhere(self._map, added, self._rng)])
        self.particles = Particles.equal(poses)
