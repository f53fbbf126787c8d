"""Errors of the command line."""


class UsageError(Exception):
    """Options that contradict each other, or that do not exist."""
