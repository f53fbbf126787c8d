"""Options from dataclasses: `tyro` with its errors folded into one line."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path
from typing import Annotated, TypeVar

import tyro

from scripts.errors import UsageError

T = TypeVar("T")

OptionalFile = Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")]
"""A file that need not be given."""

_COLOUR = re.compile(r"\x1b\[[0-9;]*m|\[/?bold\]")
_FRAME = "│╭╮╰╯|+ "
_REWORDED = (
    (r"Unrecognized options: (.*)", r"not understood: \1"),
    (r"Missing value for argument '(\S+)'.*", r"\1 needs a value"),
    (r"invalid choice (.+) for argument '(\S+)'\. Expected one of \((.*?),?\)\.", r"\2 cannot be \1; available: \3"),
    (r"Error parsing (\S+): .*invalid literal for int\(\) with base 10: (.+)", r"\1 must be an integer, not \2"),
    (r"Error parsing (\S+): .*could not convert string to float: (.+)", r"\1 must be a number, not \2"),
    (r"Error parsing (\S+): .*? instantiated from (\[.*?\])\..*", r"\1 cannot be \2"),
)
"""What tyro says -> what a stranger understands; the first that fits."""
_REMEDIES = (
    (r"(?:Perhaps you meant|Arguments similar to .*):\n(--[\w-]+)", r"did you mean \1?"),
    (r"Argument helptext:\n(.*)", r"write \1"),
    (r"Available subcommands: (.*)", r"available: \1"),
)


def parse(options: type[T], argv: list[str], verb: str, about: str | None = None) -> T:
    """Fill a dataclass, or one of a union of subcommands, from the command line; `about` stands in for its docstring.

    Raises:
        UsageError: an option is unknown, lacks its value or has one that it cannot take.
        SystemExit: `--help` was asked for and printed.
    """
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            return tyro.cli(options, args=argv, prog=f"twin {verb}", description=about, config=(tyro.conf.FlagCreatePairsOff,))
    except SystemExit as stop:
        if not stop.code:
            raise
        raise UsageError(f"{_one_line(complaint.getvalue())}; see twin {verb} --help") from None


def _one_line(text: str) -> str:
    """The problem, which stands in tyro's box above the first rule under the title, and the first remedy found below it."""
    lines = [_COLOUR.sub("", line).strip(_FRAME) for line in text.splitlines()[1:]]
    parts = re.split(r"^[─-]{4,}$", "\n".join(filter(None, lines)), flags=re.MULTILINE)
    problem, *rest = [part.strip() for part in parts if part.strip()] or [""]
    remedies = (re.sub(pattern, words, found[0]) for pattern, words in _REMEDIES if (found := re.search(pattern, "\n".join(rest))))
    return "; ".join([_reworded(problem), *list(remedies)[:1]])


def _reworded(problem: str) -> str:
    if missing := re.findall(r"(?:^Missing from .*:|\(required\))\n(.+)", problem):
        return f"missing: {', '.join(missing)}"
    line = " ".join(problem.split())
    for pattern, words in _REWORDED:
        if (found := re.fullmatch(pattern, line)) is not None:
            return found.expand(words)
    return line.rstrip(".") or "the options cannot be understood"
