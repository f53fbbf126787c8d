"""Errors of the estimator. A numerical outcome is a value (`Match.converged`, nan), never one of these."""

from __future__ import annotations

import math


class SlamError(Exception):
    """Root of all errors raised by `slam`."""


class UnknownNameError(SlamError):
    """A name that is not in a registry."""

    def __init__(self, kind: str, name: str, available: list[str]) -> None:
        self.kind, self.name, self.available = kind, name, available
        super().__init__(f"no {kind} '{name}'; available: {', '.join(available)}")


class ParameterError(SlamError):
    """A parameter with a value that nothing can be done with."""

    def __init__(self, settings: object, name: str, allowed: str) -> None:
        super().__init__(f"{type(settings).__name__}.{name} = {getattr(settings, name)}; must be {allowed}")


def require_positive(settings: object, *names: str) -> None:
    """Raise ParameterError unless these parameters are finite and above 0."""
    for name in names:
        if not 0.0 < getattr(settings, name) < math.inf:
            raise ParameterError(settings, name, "above 0")


def require_not_negative(settings: object, *names: str) -> None:
    """Raise ParameterError unless these parameters are finite and 0 or above."""
    for name in names:
        if not 0.0 <= getattr(settings, name) < math.inf:
            raise ParameterError(settings, name, "0 or above")


class MapTooLargeError(SlamError):
    """A map that would not fit into memory: a pose or a range has jumped, or the cells are too small."""

    def __init__(self, width: int, height: int, resolution: float) -> None:
        super().__init__(
            f"a map of {width} x {height} cells of {resolution:g} m is too large; a pose or a range has jumped, or take larger cells"
        )


class MapFileError(SlamError):
    """A map_server YAML or image that cannot be read."""

    def __init__(self, path: object, problem: str) -> None:
        super().__init__(f"map file {path}: {problem}")


class GoalError(SlamError):
    """A place to which no robot can drive."""


class KnownMapError(SlamError):
    """A map in which nothing can be localised."""

    def __init__(self, problem: str) -> None:
        super().__init__(f"map: {problem}")


class Nav2ParameterError(SlamError):
    """A ROS parameter file that cannot be used."""

    def __init__(self, path: object, problem: str) -> None:
        super().__init__(f"{path}: {problem}")


class TrajectoryError(SlamError):
    """Trajectories that cannot be compared or read."""


class PoseGraphError(SlamError):
    """A pose graph that cannot be read, or that cannot be: a node or a measurement that does not fit."""


class SessionError(SlamError):
    """A session's folder that cannot be used."""

    def __init__(self, folder: object, problem: str) -> None:
        super().__init__(f"session {folder}: {problem}")
