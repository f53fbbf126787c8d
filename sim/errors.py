"""Errors of the twin: what, the offending value, what would be right."""


class SimError(Exception):
    """Root of all errors raised by `sim`."""


class PhysicsError(SimError):
    """PyBullet refused."""


class TruthError(SimError):
    """A robot or a time that the twin has no truth about."""


class RealismError(SimError):
    """A realism that does not exist, or a number of it that does not."""
