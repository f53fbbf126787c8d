"""A robot's specification as text: JSON inside a recording, TOML from a user."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from hardware.errors import HardwareError, SpecError
from hardware.spec import RobotSpec
from slam.se3 import SE3


def write_spec(spec: RobotSpec) -> str:
    """The specification as JSON; every number comes back as it was."""
    return msgspec.json.encode(spec, enc_hook=_encode).decode()


def parse_spec(text: str) -> RobotSpec:
    """The specification of `write_spec`.

    Raises:
        SpecError: it is not one.
    """
    try:
        tree: Any = msgspec.json.decode(text)
    except msgspec.DecodeError as error:
        raise SpecError(f"the robot's specification is not JSON: {error}") from error
    return _build(tree, "the recorded specification")


def read_spec(path: Path) -> RobotSpec:
    """A specification from TOML: the fields of `RobotSpec`, those left out by their defaults; a mount is `{xyz = [..], rpy = [..]}`.

    Raises:
        SpecError: the file cannot be read or a value is impossible.
    """
    try:
        tree: Any = msgspec.toml.decode(path.read_bytes())
    except OSError as error:
        raise SpecError(f"robot specification {path}: cannot be read: {error.strerror}") from error
    except msgspec.DecodeError as error:
        raise SpecError(f"robot specification {path}: not TOML: {error}") from error
    return _build(_mounts(tree), f"robot specification {path}")


def _build(tree: Any, what: str) -> RobotSpec:
    try:
        return msgspec.convert(tree, RobotSpec, dec_hook=_decode)
    except (msgspec.ValidationError, ValueError) as error:
        raise SpecError(f"{what}: {error}") from error


def _mounts(tree: Any) -> Any:
    """Mounts given as xyz and rpy, as rotation and translation."""
    if not isinstance(tree, dict):
        return tree
    return {key: _mount(value) if key.startswith("T_") else _mounts(value) for key, value in tree.items()}


def _mount(value: dict[str, Any]) -> Any:
    T = SE3.from_xyz_rpy(tuple(value.get("xyz", (0.0, 0.0, 0.0))), tuple(value.get("rpy", (0.0, 0.0, 0.0))))
    return {"R": T.R.tolist(), "t": T.t.tolist()}


def _encode(value: Any) -> Any:
    return value.tolist()


def _decode(kind: type, value: Any) -> Any:
    del kind
    return np.array(value, dtype=np.float64)
