"""World files: TOML text to a `World` and back."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import msgspec
import tomli_w

from worlds.complaints import complaint
from worlds.errors import WorldFileError, WorldValueError
from worlds.lines import line_of
from worlds.world import World

_TABLES = ("wall", "box", "cylinder", "marker", "poster", "board", "door", "person")


def read_world(path: Path) -> World:
    """World of a TOML file.

    Raises:
        WorldFileError: unreadable, not TOML or an impossible world; one line that names the file, the line and the fault.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise WorldFileError(str(path), None, f"cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise WorldFileError(str(path), None, f"is not a text file in UTF-8: byte {error.start} is not") from error
    return parse_world(text, path.name)


def parse_world(text: str, name: str) -> World:
    """World of TOML text; `name` stands for the file in messages.

    Raises:
        WorldFileError: not TOML or an impossible world.
    """
    try:
        content = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # integers of 5000 digits and deep nesting come as themselves
        raise _syntax_error(name, text, str(error)) from error
    try:
        return msgspec.convert(content, World)
    except msgspec.ValidationError as error:
        fault = complaint(error, content, World)
        raise WorldFileError(name, line_of(text, fault.key), str(fault)) from error
    except WorldValueError as error:
        raise WorldFileError(name, line_of(text, error.key), str(error)) from error


def dump_world(world: World) -> str:
    """TOML text that reads back as an equal world."""
    content: dict[str, Any] = msgspec.to_builtins(world)
    light: dict[str, Any] = content.pop("light")
    tables: dict[str, list[dict[str, Any]]] = {name: content.pop(name) for name in _TABLES}
    parts = [f"[[{name}]]\n{_keys(entry)}" for name, entries in tables.items() for entry in entries]
    return "\n".join([_keys(content), f"[light]\n{_keys(light)}", *parts])


def _keys(entries: dict[str, Any]) -> str:
    return "".join(f"{key} = {_value(value)}\n" for key, value in entries.items())


def _value(value: object) -> str:
    # tomli_w puts every number of a list on a line of its own; points are read as points on one line.
    if not isinstance(value, (list, tuple)):
        return tomli_w.dumps({"key": value}).removeprefix("key = ").rstrip("\n")
    items = [_value(item) for item in cast("Sequence[object]", value)]
    if items and items[0].startswith("["):
        return "[\n" + "".join(f"    {item},\n" for item in items) + "]"
    return f"[{', '.join(items)}]"


def _syntax_error(name: str, text: str, problem: str) -> WorldFileError:
    place = re.search(r" \(at (?:line (\d+), column \d+|end of document)\)", problem)
    if place is None:
        return WorldFileError(name, None, f"not TOML: {problem.split(';', maxsplit=1)[0]}")
    line = int(place[1] or text.count("\n") + 1)
    return WorldFileError(name, line, f"not TOML: {problem[: place.start()]}")
