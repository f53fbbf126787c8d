"""How often a robot on its way among people thinks, wrongly, that it is lost or has been carried away."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scripts.experiments.arena import WorldErrors, errors_in, follow, start_in
from scripts.experiments.drive import Course
from scripts.runs.known_map import GivenMap
from slam.localization.amcl import Amcl
from slam.messages import Status

LONGEST = 600.0
"""Of one drive [s]; each has noise, and people, of its own."""
JUMP = 0.25
"""Change of the error from one frame to the next that no driving makes [m]."""


@dataclass(frozen=True, slots=True)
class Alarms:
    """False alarms of some drives."""

    driven: float
    """[s]"""
    at: tuple[tuple[str, float], ...]
    """Drive and time [s] at which each began."""
    worst: float
    """Largest error of position [m]."""


def alarms_of(given: GivenMap, world: str, duration: float, people: int, seed: int) -> Alarms:
    """Drive the tour of a world for a time [s] by `amcl`: an alarm is to be lost, not to know which place, or to jump."""
    found: list[tuple[str, float]] = []
    worst = 0.0
    for k in range(math.ceil(duration / LONGEST)):
        length, separator = min(LONGEST, duration - k * LONGEST), "," if ":" in world else ":"
        drive = Course(f"{world}{separator}people={people}", length, seed + 1 + k).drive()
        outcome = follow(Amcl().build(given.known, start_in(given, drive)), drive)
        errors = errors_in(given, drive, outcome.estimate)
        begun = _begun(errors, np.array([status in (Status.LOST, Status.AMBIGUOUS) for status in outcome.statuses]))
        found += [(f"drive {k + 1}", stamp) for stamp in errors.stamps[begun].tolist()]
        worst = max(worst, float(errors.position.max()))
    return Alarms(duration, tuple(found), worst)


def _begun(errors: WorldErrors, astray: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Frames at which an alarm begins."""
    astray = astray[: len(errors.stamps)]
    jumps = np.hypot(np.diff(errors.x, prepend=errors.x[0]), np.diff(errors.y, prepend=errors.y[0])) > JUMP
    return (astray & ~np.concatenate([[False], astray[:-1]])) | (jumps & ~astray)
