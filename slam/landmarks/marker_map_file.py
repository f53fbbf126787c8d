"""Marker maps on disk: our YAML with covariances, and ArUco's MarkerMap, which UcoSLAM and marker_mapper write and read too."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import cv2
import numpy as np
import yaml

from slam.atomic_file import replacing
from slam.landmarks.marker_map import MappedMarker, MarkerMap, MarkerMapError
from slam.landmarks.sighting import square
from slam.se2 import FloatArray
from slam.se3 import SE3

FORMAT = "bricktwin marker map 1"
METRES = 1
"""ArUco's `mInfoType` of corners in metres; 0: pixels."""
SQUARE = 0.02
"""How far corners may be from those of a square, as a share of its side."""


class MarkerMapFileError(MarkerMapError):
    """A marker map file that cannot be read."""

    def __init__(self, path: object, problem: str) -> None:
        super().__init__(f"marker map {path}: {problem}")


def write_marker_map(path: Path, markers: MarkerMap) -> None:
    """Write our YAML: metres, quaternions x y z w, covariances of translation and rotation vector in the map, row by row."""
    content = {
        "format": FORMAT,
        "dictionary": markers.dictionary,
        "T_base_camera": None if markers.T_base_camera is None else _pose_entry(markers.T_base_camera),
        "markers": [
            {
                "id": m.id,
                "size": m.size,
                **_pose_entry(m.T_map_marker),
                "sightings": m.sightings,
                "covariance": np.asarray(m.covariance).reshape(-1).tolist(),
            }
            for m in markers.markers.values()
        ],
    }
    with replacing(path) as partial:
        partial.write_text(yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=160), encoding="utf-8")


def read_marker_map(path: Path) -> MarkerMap:
    """Read our YAML, or ArUco's.

    Raises:
        MarkerMapFileError: it cannot be read.
    """
    text = _text(path)
    if text.startswith("%YAML:1.0"):
        return read_aruco_map(path)
    try:
        content: Any = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise MarkerMapFileError(path, f"is no YAML: {str(error).splitlines()[0]}") from error
    if not isinstance(content, dict) or cast("dict[str, Any]", content).get("format") != FORMAT:
        raise MarkerMapFileError(path, f"has no line `format: {FORMAT}`, and is no ArUco MarkerMap")
    try:
        return _map_of(cast("dict[str, Any]", content))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise MarkerMapFileError(path, f"an entry is missing or cannot be read: {error!r}") from error


def write_aruco_map(path: Path, markers: MarkerMap) -> None:
    """Write ArUco's MarkerMap: id and four corners of every marker, in metres."""
    lines = ["%YAML:1.0", "---", f"aruco_bc_dict: {_aruco_name(markers.dictionary)}", f"aruco_bc_nmarkers: {len(markers.markers)}"]
    lines += [f"aruco_bc_mInfoType: {METRES}", "aruco_bc_markers:"]
    for marker in markers.markers.values():
        corners = ", ".join("[ " + ", ".join(f"{value:.9g}" for value in corner) + " ]" for corner in marker.corners.tolist())
        lines.append(f"   - {{ id:{marker.id}, corners:[ {corners} ] }}")
    with replacing(path) as partial:
        partial.write_text("\n".join(lines) + "\n", encoding="utf-8")


def read_aruco_map(path: Path) -> MarkerMap:
    """Read ArUco's MarkerMap in metres.

    Raises:
        MarkerMapFileError: it cannot be read, or is in pixels.
    """
    _text(path)
    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    except cv2.error as error:
        raise MarkerMapFileError(path, f"OpenCV cannot read it: {str(error).splitlines()[0]}") from error
    nodes = storage.getNode("aruco_bc_markers")
    if nodes.empty():
        raise MarkerMapFileError(path, "has no `aruco_bc_markers`")
    if int(storage.getNode("aruco_bc_mInfoType").real()) != METRES:
        raise MarkerMapFileError(path, "is in pixels; convert it to metres with the markers' size")
    dictionary = storage.getNode("aruco_bc_dict").string()
    return MarkerMap.of([_aruco_marker(path, nodes.at(k)) for k in range(nodes.size())], _opencv_name(dictionary))


def _aruco_marker(path: Path, node: cv2.FileNode) -> MappedMarker:
    number = int(node.getNode("id").real())
    corners_node = node.getNode("corners")
    corners = np.array([[corners_node.at(i).at(k).real() for k in range(3)] for i in range(corners_node.size())])
    if corners.shape != (4, 3):
        raise MarkerMapFileError(path, f"marker {number} has {len(corners)} corners; must be 4")
    size = float(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).mean())
    T = _fitted(corners, size)
    if size <= 0.0 or np.abs(T.transform(square(size)) - corners).max() > SQUARE * size:
        raise MarkerMapFileError(
            path, f"the corners of marker {number} are no square, in the order top left, top right, bottom right, bottom left"
        )
    return MappedMarker(number, size, T)


def _fitted(corners: FloatArray, size: float) -> SE3:
    """The pose of a square with these corners: Arun, Huang, Blostein, "Least-squares fitting of two 3-D point sets" (1987)."""
    middle = corners.mean(axis=0)
    U, _, Vh = np.linalg.svd((corners - middle).T @ square(size))
    return SE3(U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vh)]) @ Vh, middle)


def _map_of(content: Mapping[str, Any]) -> MarkerMap:
    markers = [
        MappedMarker(
            int(entry["id"]),
            float(entry["size"]),
            _pose(entry),
            np.array(entry["covariance"], dtype=np.float64).reshape(6, 6),
            int(entry["sightings"]),
        )
        for entry in content["markers"]
    ]
    mount = content["T_base_camera"]
    return MarkerMap.of(markers, str(content["dictionary"]), None if mount is None else _pose(mount))


def _pose_entry(T: SE3) -> dict[str, list[float]]:
    return {"translation": T.t.tolist(), "quaternion": T.quaternion().tolist()}


def _pose(entry: Mapping[str, Any]) -> SE3:
    return SE3.from_quaternion(np.array(entry["quaternion"], dtype=np.float64), np.array(entry["translation"], dtype=np.float64))


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise MarkerMapFileError(path, f"cannot be read: {error}") from error


def _aruco_name(dictionary: str) -> str:
    """ArUco's name of OpenCV's dictionary."""
    return (
        dictionary.removeprefix("DICT_")
        if "ARUCO_MIP" in dictionary or "APRILTAG" not in dictionary
        else dictionary.removeprefix("DICT_APRILTAG_")
    )


def _opencv_name(name: str) -> str:
    """OpenCV's name of ArUco's dictionary."""
    return name if name.startswith("DICT_") else f"DICT_{name}"
