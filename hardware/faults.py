"""Things going wrong with any body, at times that are said, by a seed. For tests of what runs on top."""

from __future__ import annotations

from dataclasses import dataclass, fields

from hardware.errors import HardwareError
from hardware.fault_kinds import BeamDropout, ClockSkew, Dropped, Fault, Frozen, HostStall, StuckWheel, Unplugged
from hardware.faulty_robot import FaultyRecording, FaultyRobot, FaultyTwin
from hardware.hal import Backend, Recorded, Resettable, Robot

__all__ = ["BeamDropout", "ClockSkew", "Dropped", "FaultError", "Faults", "Frozen", "HostStall", "StuckWheel", "Unplugged"]


class FaultError(HardwareError):
    """A fault that cannot befall the body, or with an impossible number."""


@dataclass(frozen=True, slots=True)
class Faults:
    """A body with faults. The same body, faults and seed give the same readings, after a reset too."""

    body: Backend
    """Parameters of the body."""
    faults: tuple[Fault, ...] = ()
    """They act one after the other, in this order."""
    seed: int = 0
    """Of the faults' own draws."""

    def __post_init__(self) -> None:
        for fault in self.faults:
            _check(fault)
        if self.seed < 0:
            raise FaultError(f"the seed of the faults must be 0 or above, got {self.seed}")

    def build(self) -> FaultyRobot:
        """Make the body and wrap it; nothing is opened yet.

        Raises:
            FaultError: a fault's channel does not exist.
            HardwareError, or the body's own error: the body cannot be built.
        """
        return befall(self.body.build(), self.faults, self.seed)


def befall(robot: Robot, faults: tuple[Fault, ...], seed: int = 0) -> FaultyRobot:
    """The robot, which is not open yet, with faults.

    Raises:
        FaultError: a fault's channel does not exist.
    """
    devices = [channel for channel in robot.queues if channel != "commands"]
    for fault in faults:
        channel = getattr(fault, "channel", devices[0])
        if channel not in devices:
            raise FaultError(f"no channel '{channel}' to be faulty; available: {', '.join(devices)}")
    if isinstance(robot, Resettable):
        return FaultyTwin(robot, faults, seed)
    if isinstance(robot, Recorded):
        return FaultyRecording(robot, faults, seed)
    return FaultyRobot(robot, faults, seed)


def _check(fault: Fault) -> None:
    values = {field.name: getattr(fault, field.name) for field in fields(fault)}
    name = type(fault).__name__
    if not 0.0 <= values.get("share", 0.0) <= 1.0:
        raise FaultError(f"{name}.share must be within 0 and 1, got {values['share']}")
    if not 0.0 <= values["start"] <= values.get("end", values["start"]):
        raise FaultError(f"{name} must start at 0 or later and end after that, got {values['start']} to {values.get('end')}")
    if not values.get("duration", 1.0) > 0.0:
        raise FaultError(f"{name}.duration must be above 0, got {values['duration']}")
    if values.get("wheel", "left") not in ("left", "right"):
        raise FaultError(f"{name}.wheel must be left or right, got '{values['wheel']}'")
