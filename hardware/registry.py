"""Backends by name, imported on use."""

from __future__ import annotations

import importlib

from hardware.errors import UnknownBackendError
from hardware.hal import Backend

BACKENDS: dict[str, str] = {
    "sim": "sim.robot:Sim",
    "kinematic": "sim.kinematic:Kinematic",
    "ev3": "hardware.ev3_robot:Ev3",
    "replay": "hardware.replay:Replay",
}
"""name -> "module:Class"; the class is a frozen dataclass with `build() -> Robot`."""


def backend_class(name: str) -> type[Backend]:
    """The backend's parameter class.

    Raises:
        UnknownBackendError: no such name; the message lists those there are.
    """
    if name not in BACKENDS:
        raise UnknownBackendError(name, sorted(BACKENDS))
    module, _, attribute = BACKENDS[name].partition(":")
    return getattr(importlib.import_module(module), attribute)
