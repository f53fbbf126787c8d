"""The `explore` policy: from frontier to frontier until none is left, then home."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from slam.errors import require_not_negative, require_positive
from slam.messages import Estimate, SensorFrame, Twist
from slam.navigation.astray import Astray
from slam.navigation.blacklist import Blacklist
from slam.navigation.frontiers import Explorer, Frontier
from slam.navigation.navigator import Navigation, Point, Progress
from slam.navigation.outcome import Outcome
from slam.se2 import FloatArray
from slam.snapshot import Snapshot

SETTLING = 0.5
"""After an arrival, until the scans of the place are in the map [s]."""
SURE = 5
"""So many maps in a row must show no way at all."""
HOME = 0.1
"""Whoever is so near to where it started has not left [m]."""
SAME = 0.5
"""A frontier that has moved by less while it was gone to is the same [m]."""


@dataclass(frozen=True, slots=True)
class Explore:
    """Map all that can be reached, unattended, and come back."""

    explorer: Explorer = field(default_factory=Explorer)
    navigation: Navigation = field(default_factory=Navigation)
    astray: Astray = field(default_factory=Astray)
    facing: float = 1.2
    """Bearing from base at which the lidar sees a frontier well: there is no need to turn to it [rad]."""
    better: float = 0.6
    """Another frontier is gone to on the way only if the way to it is shorter than this share of the way left."""
    closer: float = 0.6
    """From so near a frontier is looked at that a look from farther away has not shown [m]."""
    tries: int = 2
    """How often a frontier is gone to in vain before it is left alone for good."""
    changes: int = 3
    """How often the robot may set out for one frontier and change its mind before it is left alone for good."""
    blacklist_radius: float = 0.4
    """About a frontier that was gone to in vain [m]."""
    blacklist_span: float = 30.0
    """How long it is left alone the first time [s]."""
    limit: float = 3600.0
    """Longest exploration [s]; then the robot goes home."""
    come_home: bool = True
    """Drive back to where it started."""

    def __post_init__(self) -> None:
        require_positive(self, "facing", "closer", "tries", "changes", "blacklist_radius", "blacklist_span", "limit")
        require_not_negative(self, "better")

    def build(self, route: FloatArray) -> ExplorePolicy:
        """Make the policy; it needs no route."""
        return ExplorePolicy(self)


class ExplorePolicy:
    """Goes to frontiers until none is left, then home; `outcome` says why it stopped."""

    def __init__(self, settings: Explore) -> None:
        self._settings = settings
        self._navigator = settings.navigation.build()
        self._astray = settings.astray.build()
        self._vain = Blacklist(settings.blacklist_radius, settings.blacklist_span)
        self._set_out = Blacklist(settings.blacklist_radius, settings.blacklist_span)  # where the robot has been on its way to
        self._home: Point | None = None
        self._began = self._settled = 0.0
        self._frontier: Frontier | None = None
        self._looked = False
        self._doubts = 0
        self._why, self._complete = "", False  # it stopped exploring
        self._outcome: Outcome | None = None

    @property
    def outcome(self) -> Outcome | None:
        """Why it is over; None while it goes on."""
        return self._outcome

    def __call__(self, frame: SensorFrame, estimate: Estimate, snapshot: Snapshot) -> Twist:
        """The next command."""
        if self._home is None:
            self._home, self._began = (estimate.T_map_base.x, estimate.T_map_base.y), frame.stamp
        if (lost := self._astray(frame, estimate)) is not None:
            return lost
        new_ways = self._navigator.see(frame, estimate, snapshot)
        if not self._looked:
            self._navigator.look_about()
            self._looked = True
        if self._why:
            self._go_home(new_ways)
        elif frame.stamp - self._began > self._settings.limit:
            self._stop(f"the limit of {self._settings.limit:g} s is over")
        else:
            self._explore(new_ways)
        return self._navigator.drive()

    def _explore(self, new_ways: bool) -> None:
        progress = self._navigator.progress
        if progress is Progress.FAILED:
            self._give_up()
        elif progress is Progress.ARRIVED:
            self._look(new_ways)
        elif new_ways and not self._navigator.looking:
            self._choose()

    def _look(self, new_ways: bool) -> None:
        """At a viewpoint: wait for a map with what is seen from here, then see whether the frontier is gone."""
        self._settled = self._settled or self._navigator.stamp + SETTLING
        if not new_ways or self._navigator.stamp < self._settled:
            return
        self._settled = 0.0
        seen = self._frontier
        if seen is not None and any(math.dist(seen.point, other.point) < 0.2 for other in self._candidates()):
            self._vain.add(seen.point, self._navigator.stamp, held=False)  # it is near: to come back later is a long way
        self._frontier = None
        self._navigator.stop()
        self._choose()

    def _give_up(self) -> None:
        """The frontier cannot be reached."""
        if self._frontier is not None:
            self._vain.add(self._frontier.point, self._navigator.stamp)
        self._frontier = None
        self._navigator.stop()

    def _candidates(self) -> list[Frontier]:
        """All frontiers that are worth a look; those looked at in vain from nearer."""
        if self._navigator.ways is None:
            return []
        explorer, ways = self._settings.explorer, self._navigator.ways
        found = explorer.frontiers(ways)
        if not any(self._vain.times(frontier.point) for frontier in found):
            return found
        near = [frontier for frontier in explorer.frontiers(ways, self._settings.closer) if self._vain.times(frontier.point)]
        return [frontier for frontier in found if not self._vain.times(frontier.point)] + near

    def _choose(self) -> None:
        """Go to the best frontier, or home when there is none."""
        s, now = self._settings, self._navigator.stamp
        candidates = [frontier for frontier in self._candidates() if not self._is_done(frontier)]
        free = [frontier for frontier in candidates if not self._vain.holds(frontier.point, now)]
        best = s.explorer.best(free or candidates)
        if best is None:
            self._end()
            return
        self._doubts = 0
        kept = self._kept(free)
        if kept is not None and best.way > s.better * kept.way:
            best = kept
        elif self._frontier is None or math.dist(best.point, self._frontier.point) > SAME:
            self._set_out.add(best.point, now, held=False)
        self._frontier = best
        heading = math.atan2(best.point[1] - best.viewpoint[1], best.point[0] - best.viewpoint[0])
        self._navigator.go(best.viewpoint, heading, s.facing)

    def _is_done(self, frontier: Frontier) -> bool:
        """Whether a frontier has been tried often enough."""
        s, going = self._settings, self._frontier
        wavered = self._set_out.times(frontier.point) > s.changes
        return self._vain.times(frontier.point) >= s.tries or (wavered and (going is None or math.dist(going.point, frontier.point) > SAME))

    def _kept(self, frontiers: list[Frontier]) -> Frontier | None:
        """The frontier that the robot is on its way to, as it is now; None where it is no more."""
        going = self._frontier
        if going is None:
            return None
        near = [frontier for frontier in frontiers if math.dist(frontier.point, going.point) < SAME]
        return min(near, key=lambda frontier: math.dist(frontier.point, going.point), default=None)

    def _end(self) -> None:
        """Stop for there is no frontier to go to; where there is no way at all somebody may stand in it, and step aside."""
        ways = self._navigator.ways
        if ways is None or int((ways.lengths < math.inf).sum()) <= 1:
            self._doubts += 1
            if self._doubts >= SURE:
                self._stop("there is no free space around the robot")
        elif left := len(self._candidates()):
            self._stop(
                f"all that can be reached is mapped but {left} places that {self._settings.tries} tries have not shown", complete=True
            )
        else:
            self._stop("all that can be reached is mapped", complete=True)

    def _stop(self, why: str, *, complete: bool = False) -> None:
        self._why, self._complete, self._frontier = why, complete, None
        self._navigator.stop()
        home, pose = self._home, self._navigator.pose
        has_not_left = home is not None and math.dist(home, (pose.x, pose.y)) < HOME
        if home is None or not self._settings.come_home or (has_not_left and not complete):
            self._outcome = Outcome(complete, why)
        else:
            self._navigator.go(home)

    def _go_home(self, new_ways: bool) -> None:
        """Drive home; a frontier that can be reached now after all is gone to first."""
        if self._complete and new_ways and any(not self._is_done(frontier) for frontier in self._candidates()):
            self._why, self._complete = "", False
            self._navigator.stop()
            self._choose()
            return
        if self._outcome is None and self._navigator.progress in (Progress.ARRIVED, Progress.FAILED):
            back = self._navigator.progress is Progress.ARRIVED
            end = "the robot is back at its start" if back else "the way back to the start is blocked"
            self._outcome = Outcome(back and self._complete, f"{self._why}; {end}")
