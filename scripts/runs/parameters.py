"""Frozen dataclasses of parameters from TOML, and back."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import tomllib

from scripts.errors import UsageError

T = TypeVar("T")


def read_parameters(settings: type[T], path: Path | None) -> T:
    """Parameters from a TOML file, or from the [parameters] of a run's config.toml; those left out keep their defaults.

    Raises:
        UsageError: the file cannot be read, or names a parameter that does not exist, or gives it a wrong value.
    """
    if path is None:
        return settings()
    try:
        tree = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(f"--params {path}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UsageError(f"--params {path}: not TOML: {error}") from error
    tree = tree.get("parameters", tree)
    _check_names(settings(), tree, str(path))
    try:
        return msgspec.convert(tree, settings)
    except msgspec.ValidationError as error:
        raise UsageError(f"--params {path}: {error}") from error


def as_tree(settings: Any) -> dict[str, Any]:  # noqa: ANN401
    """Parameters as nested dictionaries, for a config.toml."""
    return dataclasses.asdict(settings)


def _check_names(settings: Any, tree: dict[str, Any], where: str) -> None:  # noqa: ANN401
    names = {field.name for field in dataclasses.fields(settings)}
    for key, value in tree.items():
        if key not in names:
            raise UsageError(f"--params {where}: no parameter '{key}'; available: {', '.join(sorted(names))}")
        if isinstance(value, dict):
            _check_names(getattr(settings, key), value, f"{where} [{key}]")
