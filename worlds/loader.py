"""Worlds by name, by name and options, or from a file."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

from worlds.errors import UnknownWorldError, WorldOptionError
from worlds.generators import GENERATORS, PEOPLED, Generator
from worlds.life import Life
from worlds.parts import WallTexture
from worlds.toml_file import read_world
from worlds.world import World

FOLDER = Path(__file__).parent


def world_names() -> list[str]:
    """Names that `load_world` takes without options, sorted."""
    return sorted([*(name for name in GENERATORS if not necessary_options(name)), *(path.stem for path in FOLDER.glob("*.toml"))])


def necessary_options(name: str) -> list[str]:
    """Options without which a generator makes no world."""
    return [field.name for field in dataclasses.fields(GENERATORS[name]) if field.default is dataclasses.MISSING]


def load_world(text: str) -> World:
    """World of `NAME`, `FILE.toml`, or either with options: `NAME:option=value,option=value`.

    All worlds take the options of `Life`; a `seed` is the generator's too, where it has one.

    Raises:
        UnknownWorldError: no such name; the message lists those there are.
        WorldOptionError: an option or its value is wrong.
        WorldFileError: the file cannot be read; the message has the line, the value and what is allowed.
    """
    name, options = _split(text)
    values: dict[str, Any] = {"people": PEOPLED.get(name, 0), **_values(name, options)}
    life = Life(**{key: value for key, value in values.items() if key in _types(Life)})
    if name in GENERATORS:
        generator = _generator(name, values)
        return life.apply(generator.build()) if necessary_options(name) else _generated(generator, life)
    if not name.endswith(".toml") and name not in world_names():
        raise UnknownWorldError(name, world_names())
    return life.apply(read_world(Path(name) if name.endswith(".toml") else FOLDER / f"{name}.toml"))


@functools.lru_cache(maxsize=32)
def _generated(generator: Generator, life: Life) -> World:
    """A world that depends on its options alone, on no file: made once."""
    return life.apply(generator.build())


def _split(text: str) -> tuple[str, str]:
    """Name and options; a path may have colons of its own."""
    if text.endswith(".toml"):
        return text, ""
    path, ending, options = text.rpartition(".toml:")
    name, _, rest = text.partition(":")
    return (path + ".toml", options) if ending else (name, rest)


def _generator(name: str, values: dict[str, Any]) -> Generator:
    missing = [option for option in necessary_options(name) if option not in values]
    if missing:
        raise WorldOptionError(name, missing[0], f"is necessary: {name}:{missing[0]}=...")
    make: Callable[..., Generator] = GENERATORS[name]
    return make(**{key: value for key, value in values.items() if key in _types(GENERATORS[name])})


def _values(name: str, options: str) -> dict[str, Any]:
    types = {**(_types(GENERATORS[name]) if name in GENERATORS else {}), **_types(Life)}
    values: dict[str, Any] = {}
    for option in filter(None, options.split(",")):
        key, equals, text = (part.strip() for part in option.partition("="))
        if key not in types or not equals:
            raise WorldOptionError(name, key, f"write option=value; options: {', '.join(types)}")
        values[key] = _value(name, key, types[key], text)
    return values


def _types(parameters: type[Generator | Life]) -> dict[str, str]:
    return {field.name: str(field.type) for field in dataclasses.fields(parameters)}


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
    "str": (str, "text"),
    "WallTexture": ({texture: texture for texture in get_args(WallTexture)}.__getitem__, ", ".join(get_args(WallTexture))),
}
"""Type of an option -> its parser and what it takes."""
