"""Outputs of a run, written under a temporary name and renamed: a reader finds a whole file or none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from slam.atomic_file import replacing


class OutputError(Exception):
    """An output that cannot be written: no permission, no folder, no space."""

    def __init__(self, path: Path, cause: OSError) -> None:
        super().__init__(f"cannot write {path}: {cause.strerror or cause}; make room or name another place")


def write_via(path: Path, write: Callable[[Path], object]) -> None:
    """Let `write` fill a temporary file with the suffix of `path`, then rename it.

    Raises:
        OutputError: the file cannot be written.
    """
    try:
        with replacing(path) as partial:
            write(partial)
    except OSError as error:
        raise OutputError(path, error) from error


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text.

    Raises:
        OutputError: the file cannot be written.
    """
    write_via(path, lambda partial: partial.write_text(text, encoding="utf-8"))


def write_bytes(path: Path, content: bytes) -> None:
    """Write bytes.

    Raises:
        OutputError: the file cannot be written.
    """
    write_via(path, lambda partial: partial.write_bytes(content))
