"""The YAML side of a map_server map: where it lies and how bright pixels become cells."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import yaml

from slam.errors import MapFileError
from slam.grid import FREE_THRESHOLD, OCCUPIED_THRESHOLD, GridGeometry

MODES = ("trinary", "scale", "raw")


@dataclass(frozen=True, slots=True)
class MapDescription:
    """The YAML side of a map: how bright pixels become cells."""

    image: str
    resolution: float
    """[m]"""
    origin: tuple[float, float, float]
    """Pose of the lower-left corner of the image in the map: x, y [m], yaw [rad]."""
    negate: bool
    """White is occupied."""
    occupied_thresh: float
    free_thresh: float
    mode: str


def read_description(path: Path) -> MapDescription:
    """Read and check a map's YAML; `mode` may be left out.

    Raises:
        MapFileError: it is missing, unreadable, or holds an impossible value.
    """
    try:
        content = cast(object, yaml.safe_load(path.read_text()))
    except (OSError, UnicodeDecodeError) as error:
        raise MapFileError(path, f"cannot be read: {error}") from error
    except yaml.YAMLError as error:
        raise MapFileError(path, f"is not YAML: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict):
        raise MapFileError(path, "must be a YAML mapping with image, resolution, origin, negate, occupied_thresh, free_thresh")
    fields = cast(dict[str, object], content)
    return _checked(
        path,
        MapDescription(
            image=str(_value(path, fields, "image")),
            resolution=_number(path, "resolution", _value(path, fields, "resolution")),
            origin=_origin(path, _value(path, fields, "origin")),
            negate=_number(path, "negate", _value(path, fields, "negate")) != 0.0,
            occupied_thresh=_number(path, "occupied_thresh", _value(path, fields, "occupied_thresh")),
            free_thresh=_number(path, "free_thresh", _value(path, fields, "free_thresh")),
            mode=str(fields.get("mode", "trinary")),
        ),
    )


def description_text(geometry: GridGeometry, image: str) -> str:
    """YAML of a trinary map with map_server's default thresholds."""
    fields = {
        "image": image,
        "mode": "trinary",
        "resolution": geometry.resolution,
        "origin": geometry.T_map_grid.as_array().tolist(),
        "negate": 0,
        "occupied_thresh": OCCUPIED_THRESHOLD,
        "free_thresh": FREE_THRESHOLD,
    }
    return yaml.safe_dump(fields, sort_keys=False, default_flow_style=None)


def _checked(path: Path, description: MapDescription) -> MapDescription:
    if description.resolution <= 0.0:
        raise MapFileError(path, f"resolution {description.resolution} must be positive [m]")
    if not 0.0 <= description.free_thresh < description.occupied_thresh <= 1.0:
        thresholds = f"free_thresh {description.free_thresh} and occupied_thresh {description.occupied_thresh}"
        raise MapFileError(path, f"{thresholds} must be ordered within 0..1")
    if description.mode not in MODES:
        raise MapFileError(path, f"mode '{description.mode}' must be one of {', '.join(MODES)}")
    return description


def _value(path: Path, fields: Mapping[str, object], key: str) -> object:
    if fields.get(key) is None:
        raise MapFileError(path, f"key '{key}' is missing")
    return fields[key]


def _number(path: Path, key: str, value: object) -> float:
    try:
        number = float(str(value)) if not isinstance(value, bool) else float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise MapFileError(path, f"{key} '{value}' must be a finite number")
    return number


def _origin(path: Path, value: object) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(cast(list[object], value)) != 3:
        raise MapFileError(path, f"origin {value} must be [x, y, yaw]")
    x, y, yaw = (_number(path, "origin", item) for item in cast(list[object], value))
    return x, y, yaw
