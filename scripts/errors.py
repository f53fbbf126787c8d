"""Errors of the command line, and its exit codes."""

FAILED, INTERRUPTED = 2, 130


class UsageError(Exception):
    """Options that contradict each other, or that do not exist."""
