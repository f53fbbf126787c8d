"""World files: TOML text to a `World`, and the line of whatever is wrong in it.

`tomllib` keeps no line numbers, so a complaint's path (`box[2].size[1]`) is looked up in the text: the third `[[box]]`
header, then the line of its key.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import msgspec

from worlds.complaints import complaint
from worlds.errors import WorldFileError, WorldValueError
from worlds.world import World


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


def line_of(text: str, key: str) -> int | None:
    """Line number, from 1, of the key at a path such as `box[2].size[1]`; of its table's header where it is absent."""
    table, index, entry = _split(key)
    lines = text.splitlines()
    first, header = 0, None
    headers = [i for i, line in enumerate(lines) if re.match(rf"\s*\[\[\s*{table}\s*\]\]", line)]
    if headers and index < len(headers):
        first, header, wanted = headers[index] + 1, headers[index], entry
    else:
        wanted = table
    for i in range(first, len(lines)):
        if re.match(r"\s*\[\[?\s*[A-Za-z_]\w*\s*\]", lines[i]):
            break
        if re.match(rf"\s*[\"']?{wanted}[\"']?\s*=", lines[i]):
            return i + 1
    return None if header is None else header + 1


def _split(key: str) -> tuple[str, int, str]:
    match = re.match(r"(\w+)(?:\[(\d+)\])?(?:\.(\w+))?", key)
    return (match[1], int(match[2] or 0), match[3] or "") if match else ("", 0, "")


def _syntax_error(name: str, text: str, problem: str) -> WorldFileError:
    place = re.search(r" \(at (?:line (\d+), column \d+|end of document)\)", problem)
    line = int(place[1]) if place and place[1] else len(text.splitlines())
    return WorldFileError(name, line, f"not TOML: {problem[: place.start()] if place else problem}")
