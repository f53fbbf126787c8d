"""Real photographs for `twin bench markers`: ids, and the calibration's RMS."""

from __future__ import annotations

import os
from pathlib import Path

import cv2
import numpy as np

from scripts.bench.row import Row
from slam.landmarks.boards import Board, BoardFinder
from slam.landmarks.camera_calibration import calibrate
from slam.landmarks.markers import MarkerFamily, Markers
from slam.landmarks.sighting import Sighting
from slam.messages import CameraInfo

SINGLE_IDS = {23, 40, 62, 98, 124, 203}
GRID_SIZE = 0.04
"""Side of the grid board's markers [m]."""
CHARUCO = Board("charuco", 5, 7, 0.04, 0.02)
PHOTOGRAPHS = ("img_00.jpg", "img_01.jpg", "img_02.jpg", "img_03.jpg", "choriginal.jpg")


def photograph_rows() -> list[Row]:
    """Rows of OpenCV's tutorial photographs; none where they are not there."""
    folder = Path(os.environ.get("BRICKTWIN_DATA", Path(__file__).parents[3] / "shared" / "data")) / "aruco"
    if not folder.is_dir():
        return []
    return [*_id_rows(folder), _calibration_row(folder)]


def _id_rows(folder: Path) -> list[Row]:
    camera = _camera(folder / "tutorial_camera_params.yml")
    single = _seen(folder / "singlemarkersoriginal.jpg", MarkerFamily("DICT_6X6_250"), camera)
    grid = _seen(folder / "gboriginal.png", MarkerFamily(str(folder / "tutorial_dict.yml"), GRID_SIZE), camera)
    charuco = [_seen(folder / name, MarkerFamily(CHARUCO.dictionary, CHARUCO.marker), camera) for name in PHOTOGRAPHS]
    expected = [(single, SINGLE_IDS), (grid, set(range(35))), *((seen, set(range(17))) for seen in charuco)]
    missed = sum(len(ids - {s.id for s in seen}) for seen, ids in expected)
    false = sum(len({s.id for s in seen} - ids) for seen, ids in expected)
    name = f"OpenCV's photographs, {sum(len(ids) for _, ids in expected)} markers"
    return [Row("markers", f"{name}, missed", missed, "", "0"), Row("markers", f"{name}, false", false, "", "0")]


def _calibration_row(folder: Path) -> Row:
    """RMS over the ChArUco photographs that OpenCV's tutorial calibrates by."""
    finder = BoardFinder(CHARUCO)
    views = [view for name in PHOTOGRAPHS[:4] if (view := finder.find(np.asarray(cv2.imread(str(folder / name), cv2.IMREAD_GRAYSCALE))))]
    rms = calibrate(CHARUCO, views, (640, 480)).rms
    return Row(
        "markers", "calibration by four ChArUco photographs, RMS", rms, "px", "<= 0.3", "OpenCV's own (published)", 0.182, 0.182 / rms
    )


def _seen(path: Path, family: MarkerFamily, camera: CameraInfo) -> list[Sighting]:
    image = np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), np.uint8)
    return list(Markers((family,)).build().detect(image, camera).sightings)


def _camera(path: Path) -> CameraInfo:
    """Of OpenCV's calibration file."""
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    K, D = storage.getNode("camera_matrix").mat(), storage.getNode("distortion_coefficients").mat()
    storage.release()
    return CameraInfo(640, 480, K, np.asarray(D, np.float64).ravel()[:5])
