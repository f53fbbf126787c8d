"""The map that a localizer is given, and where it lies in the world."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from scripts.errors import UsageError
from scripts.runs.metrics import PLACE_OF_MAP
from slam.localization.known_map import KnownMap
from slam.map_file import read_map
from slam.se2 import SE2


@dataclass(frozen=True, eq=False)
class GivenMap:
    """A map and its place."""

    known: KnownMap
    T_world_map: SE2
    """As the run that made the map was scored; without such a run the map lies where the world does."""


def read_given_map(path: Path) -> GivenMap:
    """Read `--map`: a run's folder or a map_server YAML.

    Raises:
        MapFileError, KnownMapError, UsageError: with one line that says what is wrong.
    """
    yaml = path / "map.yaml" if path.is_dir() else path
    return GivenMap(KnownMap(read_map(yaml), yaml), _place(yaml.parent / "metrics.json") if yaml.name == "map.yaml" else SE2())


def _place(metrics: Path) -> SE2:
    if not metrics.is_file():
        return SE2()
    try:
        known = json.loads(metrics.read_text(encoding="utf-8"))
        return SE2(*(float(known[key]) for key in PLACE_OF_MAP)) if PLACE_OF_MAP[0] in known else SE2()
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise UsageError(f"--map: {metrics} cannot be read: {error}; make the map anew, or remove the file") from error
