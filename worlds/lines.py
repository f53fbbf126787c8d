"""The line of a key in TOML text.

`tomllib` keeps no line numbers, so a path such as `box[2].size[1]` is looked up in the text: the third `[[box]]` header,
then the line of its key, then in a list over several lines the item's own.
"""

from __future__ import annotations

import re

_HEADER = r"\s*\[\[?\s*{}\s*\]"
_PATH = re.compile(r"(?P<table>[^\[.]+)(?:\[(?P<index>\d+)\])?(?:\.(?P<entry>[^\[]+))?(?:\[(?P<item>\d+)\])?")


def line_of(text: str, path: str) -> int | None:
    """Line number, from 1, of the value at a path; of its table's header where the key is absent; None where that is absent too."""
    match = _PATH.match(path)
    if match is None:
        return None
    lines, table, index = text.split("\n"), re.escape(match["table"]), int(match["index"] or 0)
    headers = [i for i, line in enumerate(lines) if re.match(_HEADER.format(table), line)]
    if index >= len(headers):
        key = _key_line(lines, 0, table)
        return None if key is None else _item_line(lines, key, index) + 1
    key = _key_line(lines, headers[index] + 1, re.escape(match["entry"] or ""))
    return headers[index] + 1 if key is None else _item_line(lines, key, int(match["item"] or 0)) + 1


def _key_line(lines: list[str], first: int, key: str) -> int | None:
    """Line of `key = ...` from line `first` on, before the next header."""
    for i in range(first, len(lines)):
        if re.match(_HEADER.format(r"[A-Za-z_][\w.-]*"), lines[i]):
            return None
        if re.match(rf"\s*[\"']?{key}[\"']?\s*[=.]", lines[i]):
            return i
    return None


def _item_line(lines: list[str], first: int, index: int) -> int:
    """Line of one item, a list or an inline table, of the list that begins at line `first`; `first` where it has no such items."""
    depth, commas = 0, 0
    for i in range(first, len(lines)):
        for symbol in re.findall(r"[\[\]{},]", lines[i].split("#")[0]):
            depth += {"[": 1, "{": 1, "]": -1, "}": -1}.get(symbol, 0)
            commas += symbol == "," and depth == 1
            if depth == 2 and commas == index:
                return i
        if depth == 0:
            return first
    return first
