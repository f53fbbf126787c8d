"""Maps as map_server and nav2 keep them: a grey image and a YAML file that says where and how."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from PIL import Image

from slam.atomic_file import replacing
from slam.errors import MapFileError
from slam.grid import LOG_ODDS_LIMIT, GridGeometry, OccupancyGrid
from slam.hits_file import add_hits
from slam.map_description import MapDescription, description_text, read_description
from slam.se2 import SE2, FloatArray

FREE_PIXEL, OCCUPIED_PIXEL, UNKNOWN_PIXEL = 254, 0, 205


def read_map(yaml_path: Path) -> OccupancyGrid:
    """Read a map by nav2's rules, but that 205 is unknown in `trinary` whatever the thresholds (nav2's own 0.25 would free it).

    Every occupied cell counts as one hit at its centre, unless `slam.hits_file` has left the hits beside it. `scale` and `raw` give
    probabilities. Transparency is averaged with the colours in `trinary`, means unknown in `scale`.

    Raises:
        MapFileError: the YAML or the image is missing, unreadable, or holds an impossible value.
    """
    path = Path(yaml_path)
    description = read_description(path)
    pixels = _read_pixels(path, path.parent / description.image)
    probability = np.flipud(_probability(pixels, description))
    geometry = GridGeometry(description.resolution, probability.shape[1], probability.shape[0], SE2(*description.origin))
    grid = OccupancyGrid.empty(geometry)
    limit = 1.0 / (1.0 + math.exp(LOG_ODDS_LIMIT))
    clamped = np.clip(probability, limit, 1.0 - limit)
    grid.log_odds[:] = np.log(clamped / (1.0 - clamped))
    grid.hit_count[grid.occupied()] = 1.0
    add_hits(grid, path.with_suffix(".hits.npz"))
    return grid


def write_map(grid: OccupancyGrid, stem: Path) -> None:
    """Write `stem`.pgm (254 free, 0 occupied, 205 unknown; highest y on top) and `stem`.yaml, each whole or not at all.

    Raises:
        MapFileError: a file cannot be written.
    """
    stem = Path(stem)
    image, description = stem.with_name(f"{stem.name}.pgm"), stem.with_name(f"{stem.name}.yaml")
    palette = np.array([FREE_PIXEL, OCCUPIED_PIXEL, UNKNOWN_PIXEL], np.uint8)
    pixels = np.flipud(palette[np.select([grid.states() == 0, grid.states() == 100], [0, 1], 2)])
    height, width = pixels.shape
    try:
        with replacing(image) as partial:
            partial.write_bytes(f"P5\n{width} {height}\n255\n".encode() + pixels.tobytes())
        with replacing(description) as partial:
            partial.write_text(description_text(grid.geometry, image.name))
    except OSError as error:
        raise MapFileError(stem, f"cannot be written: {error.strerror}") from error


def _read_pixels(path: Path, image: Path) -> FloatArray:
    """Pixels (height, width, channels) in 0..255, top row first; 1 channel is grey, 3 are colours, 4 have transparency last."""
    try:
        with Image.open(image) as picture:
            return _channels(picture)
    except FileNotFoundError as error:
        raise MapFileError(path, f"its image {image} does not exist") from error
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise MapFileError(path, f"its image {image} cannot be decoded: {error}") from error


def _channels(picture: Image.Image) -> FloatArray:
    if picture.mode.startswith("I"):
        return np.asarray(picture, dtype=np.float64)[..., None] / 257.0
    if picture.has_transparency_data:
        return np.asarray(picture.convert("RGBA"), dtype=np.float64)
    mode = "L" if picture.mode in {"1", "L"} else "RGB"
    return np.atleast_3d(np.asarray(picture.convert(mode), dtype=np.float64))


def _probability(pixels: FloatArray, description: MapDescription) -> FloatArray:
    """Probability of occupancy (height, width); 0.5 is unknown."""
    averaged = pixels if description.mode == "trinary" else pixels[..., :3]
    shade = averaged.mean(axis=2)
    if description.mode == "raw":
        value = np.rint(shade)
        return np.where(value <= 100.0, value / 100.0, 0.5)
    occupancy = (shade if description.negate else 255.0 - shade) / 255.0
    occupied, free = occupancy > description.occupied_thresh, occupancy < description.free_thresh
    if description.mode == "trinary":
        unknown, between = shade == UNKNOWN_PIXEL, np.full_like(shade, 0.5)
    else:
        span = description.occupied_thresh - description.free_thresh
        unknown = pixels[..., -1] < 255.0 if pixels.shape[2] == 4 else np.zeros(shade.shape, np.bool_)
        between = np.rint((occupancy - description.free_thresh) / span * 100.0) / 100.0
    return np.select([unknown, occupied, free], [0.5, 1.0, 0.0], between)
