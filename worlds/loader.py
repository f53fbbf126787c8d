"""Worlds by name, by name and options, or from a file."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

from worlds.errors import UnknownWorldError, WorldOptionError
from worlds.generators import GENERATORS, Generator
from worlds.toml_file import read_world
from worlds.world import World

FOLDER = Path(__file__).parent


def world_names() -> list[str]:
    """Names that `load_world` knows, sorted."""
    return sorted([*GENERATORS, *(path.stem for path in FOLDER.glob("*.toml"))])


def load_world(text: str) -> World:
    """World of `NAME`, `NAME:option=value,option=value` or a path that ends in `.toml`.

    Raises:
        UnknownWorldError: no such name; the message lists those there are.
        WorldOptionError: an option or its value is wrong.
        WorldFileError: the file cannot be read; the message has the line, the value and what is allowed.
    """
    if text.endswith(".toml"):
        return read_world(Path(text))
    name, _, options = text.partition(":")
    if name in GENERATORS:
        return _generator(name, options).build()
    if name not in world_names():
        raise UnknownWorldError(name, world_names())
    if options:
        raise WorldOptionError(name, options, "this world is measured, it has no options")
    return read_world(FOLDER / f"{name}.toml")


def _generator(name: str, options: str) -> Generator:
    parameters = GENERATORS[name]
    make: Callable[..., Generator] = parameters
    types = {field.name: str(field.type) for field in dataclasses.fields(parameters)}
    values: dict[str, object] = {}
    for option in filter(None, options.split(",")):
        key, equals, text = (part.strip() for part in option.partition("="))
        if key not in types or not equals:
            raise WorldOptionError(name, key, f"write option=value; options: {', '.join(types)}")
        values[key] = _value(name, key, types[key], text)
    return make(**values)


def _value(name: str, key: str, kind: str, text: str) -> object:
    parse, meaning = _PARSERS[kind]
    try:
        return parse(text)
    except (ValueError, KeyError) as error:
        raise WorldOptionError(name, key, f"must be {meaning}, got '{text}'") from error


_PARSERS: dict[str, tuple[Callable[[str], object], str]] = {
    "float": (float, "a number"),
    "int": (int, "an integer"),
    "bool": ({"true": True, "false": False}.__getitem__, "true or false"),
}
"""Type of a generator's field -> its parser and what it takes."""
