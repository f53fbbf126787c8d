"""Frozen dataclasses of parameters from TOML."""

from __future__ import annotations

import dataclasses
import logging
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import msgspec

from scripts.errors import UsageError
from slam.errors import SlamError
from slam.localization.amcl import Amcl
from slam.localization.nav2_parameters import read_nav2

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_log = logging.getLogger(__name__)

T = TypeVar("T")


def read_parameters(settings: type[T], path: Path | None) -> T:
    """Parameters from a TOML file, or from the [parameters] of a run's config.toml; those left out keep their defaults.

    Those of `amcl` may come from a ROS parameter file, .yaml, with the names of nav2.

    Raises:
        UsageError: the file cannot be read, or names a parameter that does not exist, or gives it a wrong value.
    """
    if path is None:
        return settings()
    if path.suffix in (".yaml", ".yml"):
        return _of_ros(settings, path)
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(f"--params {path}: cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:  # bytes that are no text, and integers of 5000 digits, come as themselves
        raise UsageError(f"--params {path}: not TOML: {error}") from error
    try:
        tree = content.get("parameters", content)
        _check(settings(), tree, "")
        return msgspec.convert(tree, settings)
    except (ValueError, SlamError) as error:
        raise UsageError(f"--params {path}: {error}") from error


def _of_ros(settings: type[T], path: Path) -> T:
    if not issubclass(settings, Amcl):
        raise UsageError(f"--params {path}: only the pipeline 'amcl' reads ROS parameters; give a TOML file")
    try:
        found, ignored = read_nav2(path)
    except SlamError as error:
        raise UsageError(f"--params {error}") from error
    if ignored:
        _log.warning("%s: these parameters of nav2 mean nothing here: %s", path, ", ".join(ignored))
    return found


def _check(defaults: DataclassInstance, tree: object, table: str) -> None:
    """Raise ValueError for what msgspec passes over: a misspelt name."""
    if not isinstance(tree, dict):
        raise ValueError(f"'{table.rstrip('.') or 'parameters'}' must be a table of parameters, not {tree!r}")
    names = [field.name for field in dataclasses.fields(defaults)]
    for key, value in tree.items():
        if key not in names:
            raise ValueError(f"no parameter '{table}{key}'; available: {', '.join(table + name for name in names)}")
        default = getattr(defaults, key)
        if dataclasses.is_dataclass(default):
            _check(default, value, f"{table}{key}.")
