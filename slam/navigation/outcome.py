"""Policies that have an end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable


@dataclass(frozen=True, slots=True)
class Outcome:
    """How the drive of a policy ended."""

    reached: bool
    """What it was for."""
    reason: str
    """Why it ended: a sentence without its full stop."""


@runtime_checkable
class Concluding(Protocol):
    """A policy that is over some time."""

    @property
    def outcome(self) -> Outcome | None:
        """None while it goes on."""
        ...
