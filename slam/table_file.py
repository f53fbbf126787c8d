"""Text files of numbers in columns, read with errors that name the line."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slam.errors import TrajectoryError
from slam.se2 import FloatArray


def read_table(path: Path, columns: str) -> FloatArray:
    """Rows (N, C) of a file whose lines hold one number for each of the C names in `columns`; lines that start with # are skipped.

    Raises:
        TrajectoryError: the file cannot be read, or a line does not hold C finite numbers.
    """
    try:
        lines = Path(path).read_text().splitlines()
    except OSError as error:
        raise TrajectoryError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise TrajectoryError(f"{path}: is not text; its lines must be '{columns}'") from error
    numbered = ((number, line) for number, line in enumerate(lines, 1) if line.strip() and not line.startswith("#"))
    rows = [_parse(line, columns, f"{path}, line {number}") for number, line in numbered]
    return np.array(rows, dtype=np.float64).reshape(-1, len(columns.split()))


def _parse(line: str, columns: str, place: str) -> FloatArray:
    try:
        values = np.array(line.split(), dtype=np.float64)
    except ValueError:
        values = np.empty(0)
    if len(values) != len(columns.split()) or not np.all(np.isfinite(values)):
        raise TrajectoryError(f"{place}: '{line[:60]}' must be finite numbers '{columns}'")
    return values
