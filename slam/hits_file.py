"""What the image of a map leaves out: where in each occupied cell the wall was hit. Kept beside it as `NAME.hits.npz`."""

from __future__ import annotations

import logging
import zipfile
from pathlib import Path

import numpy as np

from slam.atomic_file import replacing
from slam.errors import MapFileError
from slam.grid import OccupancyGrid

_log = logging.getLogger(__name__)


def write_hits(grid: OccupancyGrid, path: Path) -> None:
    """Write the hits of the occupied cells, whole or not at all.

    Raises:
        MapFileError: it cannot be written.
    """
    cells = np.flatnonzero(grid.occupied())
    count, offset = grid.hit_count.reshape(-1)[cells], grid.hit_offset.reshape(-1, 2)[cells]
    try:
        with replacing(path) as partial:
            np.savez_compressed(partial, shape=np.array(grid.log_odds.shape), cells=cells, count=count, offset=offset)
    except OSError as error:
        raise MapFileError(path, f"cannot be written: {error.strerror}") from error


def add_hits(grid: OccupancyGrid, path: Path) -> None:
    """Put the hits of a file into the cells that are still occupied; without a file, or with one of another map, nothing changes."""
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            shape, cells, count, offset = (file[name] for name in ("shape", "cells", "count", "offset"))
        if tuple(shape) != grid.log_odds.shape or len(offset) != len(cells) or len(count) != len(cells):
            raise ValueError("it belongs to a map of another size")
        cells, count, offset = cells.astype(np.int64), count.astype(np.float32), offset.astype(np.float32).reshape(-1, 2)
        if len(cells) and not (cells.min() >= 0 and cells.max() < grid.log_odds.size and np.isfinite(offset).all()):
            raise ValueError("its cells are not in the map")
    except FileNotFoundError:
        return
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        _log.warning("%s is left aside, walls are known to a cell only: %s", path, error)
        return
    still = grid.occupied().reshape(-1)[cells]
    grid.hit_count.reshape(-1)[cells[still]] = count[still]
    grid.hit_offset.reshape(-1, 2)[cells[still]] = offset[still]
