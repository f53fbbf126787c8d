"""PyBullet, imported without the build time that it prints on standard error."""

from __future__ import annotations

import os
from collections.abc import Generator
from contextlib import contextmanager

from sim.errors import PhysicsError


@contextmanager
def _silent() -> Generator[None, None, None]:
    """Standard error goes nowhere; where it is closed there is nothing to do."""
    try:
        stderr = os.dup(2)
    except OSError:
        yield
        return
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 2)
    try:
        yield
    finally:
        os.dup2(stderr, 2)
        os.close(stderr)
        os.close(silence)


try:
    with _silent():
        import pybullet
except ImportError as error:
    raise PhysicsError("the robot 'sim' needs PyBullet: pip install pybullet, or take the robot 'kinematic'") from error

__all__ = ["pybullet"]
