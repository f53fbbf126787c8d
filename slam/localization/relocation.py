"""How `amcl` leaves a pose: the recovery ladder climbed, its rivals weighed, the particles drawn where the robot has been found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slam.localization.belief import Belief
from slam.localization.clusters import Cluster
from slam.localization.global_search import GlobalAnswer, Hypothesis, same
from slam.localization.known_map import KnownMap
from slam.localization.matched_mode import MatchedMode
from slam.localization.places import trouble_at
from slam.localization.recovery import Ladder, Recovery, Rung
from slam.matching.blocked_view import blocked
from slam.messages import LaserScan
from slam.scans import PointScan
from slam.se2 import SE2, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """One scan as poses are judged by it."""

    stamp: float
    cloud: PointScan
    clear: FloatArray
    """(C, 2) ends in base, at the sensor's range, of the beams that met nothing [m]."""

    @classmethod
    def of(cls, scan: LaserScan, cloud: PointScan) -> View:
        """A scan, and its hits in base."""
        angles = scan.angles[np.isposinf(scan.ranges)]
        ends = scan.range_max * np.column_stack([np.cos(angles), np.sin(angles)])
        return cls(scan.stamp, cloud, scan.T_base_laser.to_se2().transform(ends))

    @property
    def beams(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Hits (M, 2), where the laser was (M, 2), and `clear`: what `GlobalSearch` asks for."""
        return self.cloud.points, self.cloud.origins, self.clear


class Relocation:
    """Says after every scan whether the robot is somewhere else, and takes belief and mode there."""

    def __init__(self, settings: Recovery, second_mode: float, known_map: KnownMap, belief: Belief, mode: MatchedMode) -> None:
        """Begin.

        Args:
            settings: of the ladder and of the search.
            second_mode: share of the weight at which a second place makes the pose ambiguous.
            known_map: where the robot is.
            belief: seeded where it is found.
            mode: moved there.
        """
        self._settings, self._second_mode, self._map = settings, second_mode, known_map
        self._belief, self._mode = belief, mode
        self.ladder = Ladder(settings)

    @property
    def likely_modes(self) -> list[Cluster]:
        """Places where the robot may be, the likeliest first."""
        return [mode for mode in self._belief.modes if mode.weight >= self._second_mode]

    def judge(self, pose: SE2, view: View) -> Hypothesis:
        """How well a pose explains a scan."""
        return self._settings.search.judge(self._map, pose, *view.beams)

    def begin(self, view: View) -> bool:
        """Look for a robot whose start is not known in the whole map; whether there is anything like it."""
        answer = self._settings.search.search(self._map, *view.beams)
        if answer.hypotheses:
            self.take_up(answer.hypotheses, sure=False)
        return bool(answer.hypotheses)

    def take_up(self, places: Sequence[Hypothesis], sure: bool) -> None:
        """The robot is at one of these places."""
        self._belief.seed(places)
        self.ladder.begin_anew(sure)
        self._mode.move_to(self._belief.modes[0])

    def recover(self, view: View, here: Hypothesis, step: SE2, T_odom_base: SE2) -> bool:
        """Climb the ladder; whether that has led to another place.

        Args:
            view: the newest scan.
            here: the pose, judged by it.
            step: way since the scan before.
            T_odom_base: where the robot has come by its wheels.
        """
        ladder, search = self.ladder, self._settings.search
        rung = ladder.judge(view.stamp, here.explained, step, len(self.likely_modes) > 1)
        if self._hidden(view.cloud, here):
            ladder.rivals.forget()
            return False
        asked = ladder.rivals.due(view.stamp, T_odom_base)
        if asked:
            found = search.follow(self._map, ladder.rivals.places(T_odom_base), *view.beams)
            ladder.rivals.weigh(found, here, view.stamp, T_odom_base)
        places: list[Hypothesis] = []
        if rung is Rung.SEARCH:
            answer = search.search(self._map, *view.beams)
            places = list(answer.hypotheses) if self._settled(answer) else []
            ladder.rivals.meet(answer.hypotheses, here, view.stamp, T_odom_base)
        proven = self._proven(view.cloud, here) if (asked or rung is Rung.SEARCH) and not places else []
        self._belief.doubtful = ladder.lost
        if places or proven:
            self.take_up(places or proven, sure=len(proven) == 1)
        elif rung is Rung.SEARCH and ladder.lost:
            self._belief.expand(self._settings.spread_position, self._settings.spread_yaw)
        return bool(places or proven)

    def _proven(self, cloud: PointScan, here: Hypothesis) -> list[Hypothesis]:
        """Rivals that this scan, the newest of several, proves; no robot stands in a wall."""
        if not len(self.ladder.rivals):
            return []
        undenied = blocked(cloud, self._map.field, here.T_map_base)
        return [place for place in self.ladder.proven(here, undenied) if not trouble_at(self._map, place.T_map_base)]

    def _hidden(self, cloud: PointScan, here: Hypothesis) -> bool:
        """Whether a track that is trusted leads on, though the scan fits badly: people may hide what is around, and nothing denies it."""
        ladder = self.ladder
        trusted = ladder.watch.doubtful and ladder.trust.earned and len(self.likely_modes) == 1
        return trusted and blocked(cloud, self._map.field, here.T_map_base)

    def _settled(self, answer: GlobalAnswer) -> bool:
        """Whether a search decides between the places that are possible."""
        modes, places, apart = self.likely_modes, answer.hypotheses, self._settings.search.apart
        return not answer.ambiguous and len(modes) > 1 and any(same(mode.T_map_base, places[0].T_map_base, apart) for mode in modes)
