"""Errors of the robot and its recordings: what, the offending value, what would be right."""


class HardwareError(Exception):
    """Root of all errors raised by `hardware`."""


class UnknownBackendError(HardwareError):
    """A robot name that is not in the registry."""

    def __init__(self, name: str, available: list[str]) -> None:
        super().__init__(f"no robot '{name}'; available: {', '.join(available)}")


class NotOpenError(HardwareError):
    """The robot was used before `open()` or after `close()`."""

    def __init__(self) -> None:
        super().__init__("the robot is not open; use `with robot:` around reads and drives")


class RecordingError(HardwareError):
    """A recording that cannot be read on, or cannot be written."""

    def __init__(self, path: object, problem: str) -> None:
        super().__init__(f"recording {path}: {problem}")


class SpecError(HardwareError):
    """A robot specification with an impossible value."""
