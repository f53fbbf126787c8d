"""A camera's K and distortion as the YAML of ROS's camera_calibration_parsers, which `twin calibrate camera` writes too."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any, cast

import cv2
import numpy as np
import yaml

from slam.atomic_file import replacing
from slam.errors import SlamError
from slam.messages import CameraInfo
from slam.se2 import FloatArray

MODEL = "plumb_bob"
"""ROS's name of Brown-Conrady k1 k2 p1 p2 k3."""


class CameraInfoFileError(SlamError):
    """A CameraInfo YAML that cannot be read or written."""

    def __init__(self, path: object, problem: object) -> None:
        super().__init__(f"camera file {path}: {problem}")


def write_camera_info(path: Path, camera: CameraInfo, name: str = "camera", note: str = "") -> None:
    """Write a camera: a whole file or none. `note` goes above it, as a comment.

    Raises:
        CameraInfoFileError: it cannot be written.
    """
    projection = np.column_stack([camera.K, np.zeros(3)])
    content = {
        "image_width": camera.width,
        "image_height": camera.height,
        "camera_name": name,
        "camera_matrix": _matrix(camera.K),
        "distortion_model": MODEL,
        "distortion_coefficients": _matrix(camera.D.reshape(1, 5)),
        "rectification_matrix": _matrix(np.eye(3)),
        "projection_matrix": _matrix(projection),
    }
    comment = "".join(f"# {line}\n" for line in note.splitlines())
    try:
        with replacing(path) as partial:
            partial.write_text(comment + yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=200), encoding="utf-8")
    except OSError as error:
        raise CameraInfoFileError(path, error.strerror or error) from error


def read_camera_info(path: Path, size: tuple[int, int] | None = None) -> CameraInfo:
    """Read a camera, from ROS's YAML or from OpenCV's; its mount and row time, of which the file says nothing, are none.

    Args:
        path: the file.
        size: width and height [px] where the file does not tell them, as OpenCV's need not.

    Raises:
        CameraInfoFileError: it cannot be read, or is no pinhole camera with k1 k2 p1 p2 k3.
    """
    try:
        text = path.read_text(encoding="utf-8")
        content = _of_opencv(path, size) if text.startswith("%YAML:1.0") else yaml.safe_load(text)
    except OSError as error:
        raise CameraInfoFileError(path, error.strerror or error) from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise CameraInfoFileError(path, f"not YAML: {error}") from error
    if not isinstance(content, dict):
        raise CameraInfoFileError(path, "not a CameraInfo; `twin calibrate camera` writes one")
    return _camera(path, cast("dict[str, Any]", content))


def with_intrinsics(camera: CameraInfo, calibrated: CameraInfo) -> CameraInfo:
    """The camera with another's size, K and distortion; mount and shutter stay."""
    return dataclasses.replace(camera, width=calibrated.width, height=calibrated.height, K=calibrated.K, D=calibrated.D)


def _camera(path: Path, content: dict[str, Any]) -> CameraInfo:
    model = content.get("distortion_model", MODEL)
    if model != MODEL:
        raise CameraInfoFileError(path, f"distortion_model {model}; {MODEL} is right (k1 k2 p1 p2 k3)")
    try:
        size = int(content["image_width"]), int(content["image_height"])
    except (KeyError, TypeError, ValueError) as error:
        raise CameraInfoFileError(path, "image_width and image_height must be whole numbers") from error
    K, D = _numbers(path, content, "camera_matrix"), _numbers(path, content, "distortion_coefficients")
    if K.size != 9 or not (min(size) > 0 and K[0] > 0.0 and K[4] > 0.0):
        raise CameraInfoFileError(path, "camera_matrix needs 9 numbers with focal lengths above 0, and the image a size")
    if D.size > 5:
        raise CameraInfoFileError(path, f"{D.size} distortion coefficients; at most 5 are right (k1 k2 p1 p2 k3)")
    return CameraInfo(*size, K.reshape(3, 3), np.pad(D, (0, 5 - D.size)))


def _of_opencv(path: Path, size: tuple[int, int] | None) -> dict[str, Any]:
    """The entries of OpenCV's calibration file, as ROS's file has them."""
    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    except cv2.error as error:
        raise CameraInfoFileError(path, f"OpenCV cannot read it: {str(error).splitlines()[0]}") from error
    names = {"image_width": 0, "image_height": 1}
    content: dict[str, Any] = {name: size[k] for name, k in names.items() if size is not None}
    content |= {name: node.real() for name in names if not (node := storage.getNode(name)).empty()}
    matrices = {name: storage.getNode(name) for name in ("camera_matrix", "distortion_coefficients")}
    content |= {name: {"data": node.mat()} for name, node in matrices.items() if not node.empty()}
    storage.release()
    return content


def _numbers(path: Path, content: dict[str, Any], name: str) -> FloatArray:
    """The `data` of a matrix, flat."""
    try:
        numbers = np.array(content[name]["data"], dtype=np.float64).reshape(-1)
    except (KeyError, TypeError, ValueError) as error:
        raise CameraInfoFileError(path, f"{name} needs `data`, a list of numbers") from error
    if not np.isfinite(numbers).all():
        raise CameraInfoFileError(path, f"{name} must be finite")
    return numbers


def _matrix(values: FloatArray) -> dict[str, Any]:
    return {"rows": values.shape[0], "cols": values.shape[1], "data": [float(value) for value in values.ravel()]}
