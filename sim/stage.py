"""What an episode plays on: the seam between the twins, which differ in the body and in what casts the rays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from sim.drive import Drive
from sim.living import Living
from sim.motion import Motion
from sim.moving import MovingBodies
from sim.raster.painter import Painter
from sim.rays import Rays
from sim.scenery import Scenery


class Body(Protocol):
    """A robot's body in a world."""

    @property
    def motion(self) -> Motion:
        """One row for each step so far; it stays readable after `close`."""
        ...

    @property
    def collisions(self) -> int:
        """How often the robot has begun to touch something that stands in its way."""
        ...

    def advance(self, steps: int, motors: Drive) -> None:
        """Let `steps` steps of `sim.motion.STEP` pass."""
        ...

    def close(self) -> None:
        """Let go of what the body holds. May be called twice."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """The body, and what the lidar's beams can hit."""

    body: Body
    drive: Drive
    rays: Rays
    """What never moves."""
    living: Living
    """What the clock moves."""
    moving: Sequence[MovingBodies] = ()
    through_glass: Rays | None = None
    """What never moves, as if panes were not there; None in a world without panes."""
    scenery: Scenery | None = None
    """What the camera sees; None: it is off."""
    painter: Painter | None = None
    """Draws what the camera sees; None: it is off."""
