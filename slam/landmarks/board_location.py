"""Where a printed board is: from the corners of its squares, or as a map of its markers."""

from __future__ import annotations

import cv2
import numpy as np

from slam.errors import SlamError
from slam.kernels.visual_pose import rays_of
from slam.landmarks.boards import Board, BoardView
from slam.landmarks.corner_pose import CornerPose, Corners, refined
from slam.landmarks.marker_corners import lens_of
from slam.landmarks.marker_map import MappedMarker, MarkerMap
from slam.messages import CameraInfo
from slam.se2 import FloatArray
from slam.se3 import SE3

DEVIATION = 0.1
"""Of a corner where four squares meet [px]."""
UPRIGHT = np.diag([1.0, -1.0, -1.0])
"""Of a marker (y up, z out of the print) in a board (y down, z into the print)."""


class BoardGridError(SlamError):
    """A board of markers that cannot be."""


def locate_board(board: Board, view: BoardView, camera: CameraInfo) -> CornerPose | None:
    """The camera in the board's frame, by the corners that an image shows; None where most of them do not agree.

    Both poses that a flat thing may have (Collins, Bartoli 2014) are tried; the likelier one is the answer.
    """
    points = board.corners[view.numbers]
    rays = rays_of(np.ascontiguousarray(view.pixels), lens_of(camera))
    variance = DEVIATION**2 / (camera.K[0, 0] * camera.K[1, 1])
    corners = Corners(points[:, None], rays[:, None], np.tile(variance * np.eye(2), (len(points), 1, 1, 1)))
    found = [refined(corners, start) for start in _starts(points, rays)]
    best = min(found, key=lambda pose: pose.cost, default=None)
    return best if best is not None and best.believable else None


def grid_board(across: int, down: int, marker: float, gap: float, dictionary: str, first: int = 0) -> MarkerMap:
    """A board of markers in rows, as a map in the board's frame: origin at the top left corner, x right, y down, z into the print.

    Args:
        across: markers in a row.
        down: rows.
        marker: side of a black square [m].
        gap: from square to square [m].
        dictionary: of the markers.
        first: id of the top left one; the others follow row by row.

    Raises:
        BoardGridError: a number or a length is not above 0.
    """
    if not (across > 0 and down > 0 and marker > 0.0 and gap > 0.0 and first >= 0):
        raise BoardGridError(f"a board of {across} x {down} markers of {marker:g} m, {gap:g} m apart; all must be above 0")
    middle, pitch = 0.5 * marker, marker + gap
    places = [np.array([middle + column * pitch, middle + row * pitch, 0.0]) for row in range(down) for column in range(across)]
    markers = (MappedMarker(first + k, marker, SE3(UPRIGHT, place)) for k, place in enumerate(places))
    return MarkerMap.of(markers, dictionary)


def _starts(points: FloatArray, rays: FloatArray) -> list[SE3]:
    """Poses of the camera in the frame of flat points (N, 3); none where the points lie on a line."""
    try:
        _, turns, places, _ = cv2.solvePnPGeneric(points, rays, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
    except cv2.error:
        return []
    poses = [SE3(np.asarray(cv2.Rodrigues(r)[0], np.float64), np.asarray(t, np.float64)) for r, t in zip(turns, places, strict=True)]
    return [pose.inverse() for pose in poses if np.isfinite(pose.matrix()).all()]
