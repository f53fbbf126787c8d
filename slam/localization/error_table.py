"""The error table of document B: for every cell the distance to the nearest wall, made once and kept beside the map."""

from __future__ import annotations

import hashlib
import logging
import zipfile
from dataclasses import astuple, dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slam.atomic_file import replacing
from slam.errors import require_positive
from slam.grid import OccupancyGrid
from slam.kernels import segment_table as kernels
from slam.localization.known_map import KnownMap
from slam.localization.wall_segments import WallSegments
from slam.se2 import SE2, FloatArray

_log = logging.getLogger(__name__)

KEPT = ".walls.npz"
VERSION = "1"
"""Of the file; one of another version is made anew."""
MOST_CELLS = 8_000_000
"""A table that would have more is made with the map's own cells."""


@dataclass(frozen=True, eq=False)
class ErrorTable:
    """Distances at the corners of cells. Bilinear interpolation gives d, its derivative the gradient."""

    distances: NDArray[np.float32]
    """(H, W) to the nearest wall [m], the sign tells its side; row 0, column 0 is the origin of the table's frame."""
    cell: float
    """[m]"""
    T_map_table: SE2
    segments: FloatArray
    """(S, 4) in the map [m]."""
    points: FloatArray
    """(P, 2) hits that belong to no segment, in the map [m]."""

    @cached_property
    def patches(self) -> NDArray[np.float32]:
        """(H - 1, W - 1, 4) the bilinear interpolant of each cell: distance and gradient."""
        return kernels.patches(self.distances, self.cell)


@dataclass(frozen=True, slots=True)
class TableSettings:
    """How the error table is made of a map."""

    walls: WallSegments = field(default_factory=WallSegments)
    finer: int = 2
    """Cells of the table along one of the map."""
    reach: float = 1.0
    """Distances beyond this are not told apart [m]."""
    clutter: bool = True
    """Hits that belong to no straight wall enter the table as points. Document B leaves them out, blind where nothing is straight."""

    def __post_init__(self) -> None:
        require_positive(self, "finer", "reach")

    def of(self, grid: OccupancyGrid) -> ErrorTable:
        """Make the table of a map."""
        walls = self.walls.of(grid)
        g = grid.geometry
        finer = self.finer if g.width * g.height * self.finer**2 <= MOST_CELLS else 1
        cell = g.resolution / finer
        distances = np.full((g.height * finer + 1, g.width * finer + 1), self.reach, np.float32)
        T_table_map = g.T_map_grid.inverse()
        kernels.draw_segments(distances, T_table_map.transform(walls.segments.reshape(-1, 2)).reshape(-1, 4), cell, self.reach)
        if self.clutter:
            kernels.draw_points(distances, T_table_map.transform(walls.points), cell, self.reach)
        return ErrorTable(distances, cell, g.T_map_grid, walls.segments, walls.points)

    def kept(self, known_map: KnownMap) -> ErrorTable:
        """The table that is kept beside the map's file as NAME.walls.npz, if it is of this very map; else a new one, which is kept."""
        if known_map.file is None:
            return self.of(known_map.grid)
        path, fingerprint = known_map.file.with_suffix(KEPT), self._fingerprint(known_map.grid)
        table = _read(path, fingerprint)
        if table is None:
            table = self.of(known_map.grid)
            _write(path, table, fingerprint)
        return table

    def _fingerprint(self, grid: OccupancyGrid) -> str:
        """Of everything that the table depends on."""
        g = grid.geometry
        text = f"{VERSION} {g.resolution!r} {g.width} {g.height} {g.T_map_grid!r} {astuple(self)!r}"
        occupied = grid.occupied()
        parts = (occupied, grid.hit_offset[occupied], grid.hit_count[occupied], grid.states())
        digest = hashlib.sha256(text.encode())
        for part in parts:
            digest.update(np.ascontiguousarray(part).tobytes())
        return digest.hexdigest()


def _read(path: Path, fingerprint: str) -> ErrorTable | None:
    try:
        with np.load(path, allow_pickle=False) as file:
            if str(file["fingerprint"]) != fingerprint:
                _log.info("%s belongs to another map; it is made anew", path)
                return None
            T_map_table = SE2.from_array(file["T_map_table"])
            distances, segments, points = (file[name] for name in ("distances", "segments", "points"))
            return ErrorTable(distances, float(file["cell"]), T_map_table, segments, points)
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        _log.warning("%s cannot be read and is made anew: %s", path, error)
        return None


def _write(path: Path, table: ErrorTable, fingerprint: str) -> None:
    try:
        with replacing(path) as partial:
            np.savez_compressed(
                partial,
                fingerprint=np.array(fingerprint),
                cell=np.array(table.cell),
                T_map_table=table.T_map_table.as_array(),
                distances=table.distances,
                segments=table.segments,
                points=table.points,
            )
    except OSError as error:
        _log.warning("the error table is not kept: %s cannot be written: %s", path, error)
