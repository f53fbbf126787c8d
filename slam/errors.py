"""Errors of the estimator. A numerical outcome is a value (`Match.converged`, nan), never one of these."""


class SlamError(Exception):
    """Root of all errors raised by `slam`."""


class UnknownNameError(SlamError):
    """A name that is not in a registry."""

    def __init__(self, kind: str, name: str, available: list[str]) -> None:
        self.kind, self.name, self.available = kind, name, available
        super().__init__(f"no {kind} '{name}'; available: {', '.join(available)}")


class MapFileError(SlamError):
    """A map_server YAML or image that cannot be read."""

    def __init__(self, path: object, problem: str) -> None:
        super().__init__(f"map file {path}: {problem}")


class TrajectoryError(SlamError):
    """Trajectories that cannot be compared or read."""
