"""`robot.toml`: what the robot is, and what is plugged in where, in one file that every verb reads."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import cast

import msgspec
import tomli_w

from hardware.drivers.brick_driver import Ev3Ports
from hardware.errors import HardwareError, SpecError
from hardware.logs.spec_file import parse_spec_tree
from hardware.spec import RobotSpec

Tree = dict[str, object]


@dataclass(frozen=True, slots=True)
class RobotFile:
    """What the file says."""

    spec: RobotSpec = field(default_factory=RobotSpec)
    ports: Ev3Ports = field(default_factory=Ev3Ports)


def read_robot_file(path: Path) -> RobotFile:
    """A robot from TOML: the fields of `RobotSpec` and a table `[ports]` with those of `Ev3Ports`, what is left out by its default.

    Raises:
        SpecError: the file cannot be read or a value is impossible.
    """
    where, tree = f"robot specification {path}", _tree(path)
    ports = tree.pop("ports", {})
    try:
        plugged = msgspec.convert(ports, Ev3Ports)
    except (msgspec.ValidationError, HardwareError) as error:
        raise SpecError(f"{where}: [ports]: {error}") from error
    known = [port.name for port in fields(Ev3Ports)]
    if unknown := set(cast(Tree, ports)) - set(known):
        raise SpecError(f"{where}: no port '{min(unknown)}'; there are {', '.join(known)}")
    return RobotFile(parse_spec_tree(tree, where), plugged)


def update_robot_file(path: Path, changes: Mapping[str, object]) -> None:
    """Write changes into a robot's file, table by table; what is not changed stays, a file that is missing begins.

    Raises:
        SpecError: the file, or what it would become, is no robot's; it stays as it was.
    """
    tree = _merged(_tree(path) if path.exists() else {}, changes)
    partial = path.with_name(f".{path.name}.partial")
    try:
        partial.write_text(tomli_w.dumps(tree), encoding="utf-8")
        read_robot_file(partial)
        partial.replace(path)
    except OSError as error:
        raise SpecError(f"robot specification {path}: cannot be written: {error.strerror}") from error
    finally:
        partial.unlink(missing_ok=True)


def _tree(path: Path) -> Tree:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SpecError(f"robot specification {path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise SpecError(f"robot specification {path}: not TOML: {error}") from error


def _merged(tree: Tree, changes: Mapping[str, object]) -> Tree:
    """The tree with changes; a mount (T_...) is changed as a whole."""
    for name, value in changes.items():
        branch = tree.get(name, {})
        deeper = isinstance(value, Mapping) and isinstance(branch, dict) and not name.startswith("T_")
        tree[name] = _merged(cast(Tree, branch), cast(Tree, value)) if deeper else value
    return tree
