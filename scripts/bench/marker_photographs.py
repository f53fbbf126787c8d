"""Real photographs for `twin bench markers`: ids, and the calibration's RMS."""

from __future__ import annotations

import os
from pathlib import Path

import cv2
import numpy as np

from scripts.bench.row import Row
from scripts.locating.targets import MarkerSet, SquaresBoard, Target
from slam.landmarks.board_location import grid_board
from slam.landmarks.boards import Board, BoardFinder
from slam.landmarks.camera_calibration import calibrate
from slam.landmarks.camera_info_file import read_camera_info
from slam.landmarks.markers import MarkerFamily, Markers
from slam.landmarks.sighting import Sighting
from slam.messages import CameraInfo
from slam.se3 import SE3

SINGLE_IDS = {23, 40, 62, 98, 124, 203}
GRID_SIZE, GRID_GAP = 0.04, 0.01
"""Side of the grid board's markers and the gap between them [m]."""
SIZE = (640, 480)
"""Of the photographs [px]."""
CHARUCO = Board("charuco", 5, 7, 0.04, 0.02)
PHOTOGRAPHS = ("img_00.jpg", "img_01.jpg", "img_02.jpg", "img_03.jpg", "choriginal.jpg")


def photograph_rows() -> list[Row]:
    """Rows of OpenCV's tutorial photographs; none where they are not there."""
    folder = Path(os.environ.get("BRICKTWIN_DATA", Path(__file__).parents[3] / "shared" / "data")) / "aruco"
    if not folder.is_dir():
        return []
    return [*_id_rows(folder), _calibration_row(folder), *_board_rows(folder)]


def _id_rows(folder: Path) -> list[Row]:
    camera = read_camera_info(folder / "tutorial_camera_params.yml", SIZE)
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
    rms = calibrate(CHARUCO, views, SIZE).rms
    return Row(
        "markers", "calibration by four ChArUco photographs, RMS", rms, "px", "≤ 0.3", "OpenCV's own (published)", 0.182, 0.182 / rms
    )


def _board_rows(folder: Path) -> list[Row]:
    """How far our poses are from those that OpenCV's solvePnP finds from the same corners."""
    grid = MarkerSet("board", grid_board(5, 7, GRID_SIZE, GRID_GAP, str(folder / "tutorial_dict.yml")))
    shown: list[tuple[Target, str, str]] = [(grid, "gboriginal.png", "tutorial_camera_params.yml")]
    shown += [(SquaresBoard(CHARUCO), name, "tutorial_camera_charuco.yml") for name in PHOTOGRAPHS]
    off = np.array([_off_from_opencv(target, folder / name, read_camera_info(folder / camera, SIZE)) for target, name, camera in shown])
    name = f"boards on {len(off)} photographs, farthest from solvePnP's pose by the same corners"
    return [
        Row("markers", f"{name}, position", 1e3 * float(off[:, 0].max()), "mm", "≤ 2"),
        Row("markers", f"{name}, rotation", float(np.degrees(off[:, 1].max())), "deg", "≤ 0.2"),
    ]


def _off_from_opencv(target: Target, path: Path, camera: CameraInfo) -> tuple[float, float]:
    """Distance [m] and angle [rad]; inf where the board is not found."""
    image = np.asarray(cv2.cvtColor(cv2.imread(str(path)), cv2.COLOR_BGR2RGB), np.uint8)
    found, _ = target.find(image, camera)
    if not found:
        return np.inf, np.inf
    _, turn, place = cv2.solvePnP(found[0].points, found[0].pixels, camera.K, camera.D)
    theirs = SE3(np.asarray(cv2.Rodrigues(turn)[0], np.float64), np.asarray(place, np.float64))
    away = theirs.inverse() @ found[0].T_camera_target
    return float(np.linalg.norm(theirs.t - found[0].T_camera_target.t)), float(np.linalg.norm(away.log()[3:]))


def _seen(path: Path, family: MarkerFamily, camera: CameraInfo) -> list[Sighting]:
    image = np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), np.uint8)
    return list(Markers((family,)).build().detect(image, camera).sightings)
