"""What msgspec finds wrong, in the words of a world file: the path of the key, the value there, what is allowed."""

from __future__ import annotations

import math
import re
from typing import Annotated, cast, get_args, get_origin

import msgspec
from msgspec import structs

from worlds.errors import WorldValueError

_WORDS = (
    ("Expected", "must be"),
    ("`float`", "a number"),
    ("`int`", "an integer"),
    ("`str`", "text"),
    ("`array`", "a list"),
    ("`object`", "a table"),
)


def complaint(error: msgspec.ValidationError, content: object, kind: object) -> WorldValueError:
    """Msgspec's complaint about `content`, decoded as `kind`, as ours."""
    problem, path = _split(error)
    value: object = msgspec.UNSET
    for step in re.findall(r"\w+", path):
        content, kind = _item(content, step), _inner(kind, step)
    if problem.startswith("Object contains unknown"):
        table, allowed = cast("dict[str, object]", content), [field.encode_name for field in _fields(kind)]
        unknown = next(key for key in table if key not in allowed)
        path, value, problem = f"{path}.{unknown}", table[unknown], f"unknown key; allowed: {', '.join(allowed)}"
    elif missing := re.match(r"Object missing required field (\w+)", problem):
        path, problem = f"{path}.{missing[1]}", "is missing"
    else:
        value = content
    if problem.startswith("Invalid enum value"):
        problem = f"must be one of {', '.join(get_args(kind))}"
    if isinstance(value, float) and not math.isfinite(value):
        problem = "must be a finite number"
    return WorldValueError(path.lstrip("."), value, problem)


def _split(error: msgspec.ValidationError) -> tuple[str, str]:
    """What is wrong, in plain words, and the path to it, such as `box[2].size[1]`."""
    problem, _, path = str(error).partition(" - at `$")
    for word, plain in _WORDS:
        problem = problem.replace(word, plain)
    return problem.replace("`", ""), path.rstrip("`").lstrip(".")


def _item(content: object, step: str) -> object:
    """One value of a table or one item of a list."""
    return cast("list[object]", content)[int(step)] if step.isdigit() else cast("dict[str, object]", content)[step]


def _fields(kind: object) -> tuple[structs.FieldInfo, ...]:
    return structs.fields(cast("type[msgspec.Struct]", kind))


def _inner(kind: object, step: str) -> object:
    """Type of one field of a struct or of one item of a tuple."""
    kind = get_args(kind)[0] if get_origin(kind) is Annotated else kind
    if not step.isdigit():
        return next(field.type for field in _fields(kind) if field.encode_name == step)
    items = get_args(kind)
    return items[0] if items[-1] is ... else items[int(step)]
