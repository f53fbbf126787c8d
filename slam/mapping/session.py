"""A session on disk: the submaps and what ties them together, to go on mapping or only to localise."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from slam.atomic_file import replacing
from slam.errors import MapTooLargeError, SessionError
from slam.grid import GridGeometry
from slam.mapping.compact_grid import CompactGrid
from slam.mapping.grid_mapper import MapSettings
from slam.mapping.submap import Keyframe, Submap
from slam.mapping.submaps import Link, Submaps
from slam.se2 import SE2

VERSION = 3
NAME = "session.npz"
OF_A_SUBMAP = ("geometry", "steps", "cells", "counts", "offsets", "facings", "keyframes", "points", "beams")
Arrays = dict[str, NDArray[Any]]


def save_session(folder: Path, submaps: Submaps) -> None:
    """Write `session.npz` into the folder, whole or not at all.

    Raises:
        SessionError: it cannot be written.
    """
    links = submaps.believed()
    arrays: Arrays = {
        "version": np.array(VERSION),
        "origins": np.array([[submap.stamp, *submap.T_map_submap.as_array()] for submap in submaps.all]).reshape(-1, 4),
        "link_nodes": np.array([[link.i, link.j, link.closure] for link in links], np.int64).reshape(-1, 3),
        "link_poses": np.array([link.T_i_j.as_array() for link in links]).reshape(-1, 3),
        "link_covariances": np.array([link.covariance for link in links]).reshape(-1, 3, 3),
    }
    for submap in submaps.all:
        arrays |= {f"{submap.number}/{name}": array for name, array in _arrays_of(submap).items()}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with replacing(folder / NAME) as partial:
            np.savez_compressed(partial, allow_pickle=False, **arrays)
    except OSError as error:
        raise SessionError(folder, f"cannot be written: {error.strerror}") from error


def load_session(folder: Path, settings: MapSettings) -> Submaps | None:
    """The submaps of an earlier session; None where the folder holds none.

    Raises:
        SessionError: it cannot be read, is of another version, or was made with cells of another size.
    """
    path = folder / NAME
    if not path.exists():
        return None
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = cast("Arrays", {name: file[name] for name in file.files})
    except (OSError, ValueError, zipfile.BadZipFile, EOFError) as error:
        raise SessionError(folder, f"{NAME} cannot be read: {error}") from error
    version = arrays["version"].tolist() if "version" in arrays else None
    if version != VERSION:
        raise SessionError(folder, f"{NAME} is of version {version}; this is version {VERSION}: make it anew in another folder")
    try:
        return _restored(arrays, settings)
    except (KeyError, IndexError, TypeError, ValueError, MapTooLargeError, np.linalg.LinAlgError) as error:
        raise SessionError(folder, f"{NAME} is damaged: {error}") from error


def _arrays_of(submap: Submap) -> Arrays:
    compact, keyframes = submap.compact(), submap.keyframes
    g = compact.geometry
    return {
        "geometry": np.array([g.resolution, g.T_map_grid.x, g.T_map_grid.y]),
        "steps": compact.steps,
        "cells": compact.cells,
        "counts": compact.counts,
        "offsets": compact.offsets,
        "facings": compact.facings,
        "keyframes": np.array([[k.stamp, *k.T_submap_base.as_array(), len(k.points), k.widens] for k in keyframes]).reshape(-1, 6),
        "points": np.concatenate([np.empty((0, 2), np.float32), *(k.points for k in keyframes)]),
        "beams": np.concatenate([np.empty((0, 2), np.float32), *(k.origins for k in keyframes)]),
    }


def _restored(arrays: Mapping[str, NDArray[Any]], settings: MapSettings) -> Submaps:
    submaps = Submaps()
    for number, (stamp, *pose) in enumerate(arrays["origins"].tolist()):
        own = {name: arrays[f"{number}/{name}"] for name in OF_A_SUBMAP}
        submaps.add(Submap.restore((number, stamp, SE2(*pose)), settings, _compact(own, settings), _keyframes(own)))
    rows = zip(arrays["link_nodes"].tolist(), arrays["link_poses"], arrays["link_covariances"], strict=True)
    for (i, j, closure), pose, covariance in rows:
        submaps.tie(Link(i, j, SE2.from_array(pose), covariance, bool(closure)))
    return submaps


def _compact(own: Mapping[str, NDArray[Any]], settings: MapSettings) -> CompactGrid:
    resolution, x, y = own["geometry"].tolist()
    if abs(resolution - settings.resolution) > 1e-9:
        raise ValueError(f"its cells are {resolution:g} m wide, those asked for {settings.resolution:g} m")
    height, width = own["steps"].shape
    geometry = GridGeometry(resolution, width, height, SE2(x, y))
    return CompactGrid(geometry, own["steps"], own["cells"], own["counts"], own["offsets"], own["facings"])


def _keyframes(own: Mapping[str, NDArray[Any]]) -> list[Keyframe]:
    ends = np.cumsum(own["keyframes"][:, 4]).astype(np.int64)
    keyframes: list[Keyframe] = []
    for (stamp, x, y, yaw, count, widens), end in zip(own["keyframes"].tolist(), ends.tolist(), strict=True):
        scan = slice(end - int(count), end)
        keyframes.append(Keyframe(stamp, SE2(x, y, yaw), own["points"][scan], own["beams"][scan], bool(widens)))
    return keyframes
