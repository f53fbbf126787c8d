"""Frozen dataclasses of parameters from TOML."""

from __future__ import annotations

import dataclasses
import tomllib
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from scripts.errors import UsageError
from slam.errors import SlamError

T = TypeVar("T")


def read_parameters(settings: type[T], path: Path | None) -> T:
    """Parameters from a TOML file, or from the [parameters] of a run's config.toml; those left out keep their defaults.

    Raises:
        UsageError: the file cannot be read, or names a parameter that does not exist, or gives it a wrong value.
    """
    if path is None:
        return settings()
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


def _check(defaults: Any, tree: Any, table: str) -> None:  # noqa: ANN401
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
