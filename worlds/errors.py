"""Errors of worlds: what, the offending value, what would be right."""

from __future__ import annotations

import difflib
from typing import cast

from msgspec import UNSET


class WorldError(Exception):
    """Root of all errors raised by `worlds`."""


class UnknownWorldError(WorldError):
    """A world name that is neither a generator nor a file of this package."""

    def __init__(self, name: str, available: list[str]) -> None:
        nearest = difflib.get_close_matches(name, available, n=1)
        hint = f"; did you mean {nearest[0]}?" if nearest else ""
        super().__init__(f"no world '{name}'; available: {', '.join(available)}, map:file=FILE.yaml, or a path to a .toml file{hint}")


class WorldOptionError(WorldError):
    """An option that a world does not have, or a value that it does not take."""

    def __init__(self, world: str, option: str, problem: str) -> None:
        super().__init__(f"world {world}, option {option}: {problem}")


class WorldFileError(WorldError):
    """A world file that cannot be read: unreadable, not TOML, or describing an impossible world."""

    def __init__(self, name: str, line: int | None, problem: str) -> None:
        self.line = line
        super().__init__(f"{name}: {problem}" if line is None else f"{name} line {line}: {problem}")


class WorldValueError(WorldError):
    """A value that no world can have. `key` is its path as in the TOML file, such as `box[2].size[1]`; `UNSET` where there is no value."""

    def __init__(self, key: str, value: object, allowed: str) -> None:
        self.key = key
        super().__init__(f"{key} {allowed}" if value is UNSET else f"{key} = {_brief(value)}: {allowed}")


def _brief(value: object) -> str:
    told: object = list(cast("tuple[object, ...]", value)) if isinstance(value, tuple) else value
    text = repr(told)
    return text if len(text) <= 60 else text[:57] + "..."
