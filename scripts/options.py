"""Options from dataclasses: `tyro` with its errors folded into one line."""

from __future__ import annotations

import contextlib
import io
import re
from typing import TypeVar

import tyro

from scripts.errors import UsageError

T = TypeVar("T")


def parse(options: type[T], argv: list[str], verb: str) -> T:
    """Fill a dataclass from the command line.

    Raises:
        UsageError: an option is unknown, lacks its value or has one that it cannot take.
        SystemExit: `--help` was asked for and printed.
    """
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            return tyro.cli(options, args=argv, prog=f"twin {verb}", config=(tyro.conf.FlagConversionOff,))
    except SystemExit as stop:
        if not stop.code:
            raise
        raise UsageError(f"{_one_line(complaint.getvalue())}; see twin {verb} --help") from None


def _one_line(text: str) -> str:
    """The message inside the box that tyro draws."""
    lines = [re.sub(r"\x1b\[[0-9;]*m", "", line).strip("│╭╮╰╯─ \n") for line in text.splitlines()]
    kept: list[str] = []
    for line in lines:
        if not line or line.startswith(("Parsing error", "Unrecognized options", "Required options", "For full help")):
            continue
        if line.startswith("Perhaps you meant"):
            break
        kept.append(line.rstrip(":"))
    return " ".join(kept) or "the options cannot be understood"
