"""A robot's specification as text: JSON inside a recording, TOML from a user."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import msgspec
import numpy as np

from hardware.errors import SpecError
from hardware.spec import RobotSpec
from slam.se2 import FloatArray
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
        tree: object = msgspec.json.decode(text)
    except msgspec.DecodeError as error:
        raise SpecError(f"the robot's specification is not JSON: {error}") from error
    return _build(tree, "the recorded specification")


def read_spec(path: Path) -> RobotSpec:
    """A specification from TOML: the fields of `RobotSpec`, those left out by their defaults; a mount is `{xyz = [..], rpy = [..]}`.

    Raises:
        SpecError: the file cannot be read or a value is impossible.
    """
    try:
        tree = msgspec.toml.decode(path.read_bytes())
    except OSError as error:
        raise SpecError(f"robot specification {path}: cannot be read: {error.strerror}") from error
    except msgspec.DecodeError as error:
        raise SpecError(f"robot specification {path}: not TOML: {error}") from error
    tree = cast(dict[str, object], tree)
    tree.pop("ports", None)  # of the real robot, see `hardware.robot_file`
    return parse_spec_tree(tree, f"robot specification {path}")


def parse_spec_tree(tree: object, where: str) -> RobotSpec:
    """The specification in a TOML tree; `where` it is from, for messages.

    Raises:
        SpecError: a field is unknown or a value is impossible.
    """
    spec = _build(_mounts(tree), where)
    _refuse_unknown(_mounts(tree), msgspec.to_builtins(spec, enc_hook=_encode), where)
    return spec


def _build(tree: object, what: str) -> RobotSpec:
    try:
        return msgspec.convert(tree, RobotSpec, dec_hook=_decode)
    except (msgspec.ValidationError, ValueError) as error:
        raise SpecError(f"{what}: {error}") from error


def _refuse_unknown(tree: object, known: object, where: str) -> None:
    """Raise SpecError for a misspelt name: msgspec passes over it."""
    if isinstance(tree, dict) and isinstance(known, dict):
        fields = cast(dict[str, object], known)
        for name, branch in cast(dict[str, object], tree).items():
            if name not in fields:
                raise SpecError(f"{where}: no field '{name}'; there are {', '.join(fields)}")
            _refuse_unknown(branch, fields[name], where)


def _mounts(tree: object) -> object:
    """The same tree, with mounts given as xyz and rpy turned into rotation and translation."""
    if not isinstance(tree, dict):
        return tree
    branches = cast(dict[str, object], tree)
    if branches and branches.keys() <= {"xyz", "rpy"}:
        T = SE3.from_xyz_rpy(_triple(branches, "xyz"), _triple(branches, "rpy"))
        return {"R": T.R.tolist(), "t": T.t.tolist()}
    return {key: _mounts(branch) for key, branch in branches.items()}


def _triple(mount: dict[str, object], name: str) -> tuple[float, float, float]:
    try:
        return msgspec.convert(mount.get(name, (0.0, 0.0, 0.0)), tuple[float, float, float])
    except msgspec.ValidationError as error:
        raise SpecError(f"{name} = {mount[name]} of a mount: {error}; three numbers are right") from error


def _encode(array: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> list[object]:
    return array.tolist()


def _decode(kind: type, values: list[object]) -> FloatArray:
    del kind
    return np.array(values, dtype=np.float64)
