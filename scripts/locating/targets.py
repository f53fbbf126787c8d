"""What can be looked for in a photograph, and how it is found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from slam.landmarks.board_location import locate_board
from slam.landmarks.boards import Board, BoardFinder
from slam.landmarks.camera_location import locate_camera
from slam.landmarks.corner_pose import Corners, refined
from slam.landmarks.marker_family import MarkerFamily
from slam.landmarks.marker_location import MarkerField
from slam.landmarks.marker_map import MarkerMap
from slam.landmarks.markers import Markers
from slam.landmarks.sighting import Sighting, square
from slam.messages import CameraInfo
from slam.se2 import FloatArray
from slam.se3 import SE3, skew

Image = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A thing that a photograph shows."""

    name: str
    T_camera_target: SE3
    covariance: FloatArray
    """(6, 6) of the camera in the target's frame: translation and rotation vector, in the camera's axes [m, rad]."""
    points: FloatArray
    """(N, 3) corners that are seen, in the target's frame [m]."""
    pixels: FloatArray
    """(N, 2) where [px]."""
    used: int
    """Corners that agree."""
    ratio: float = np.nan
    """Of a lone marker: how many times larger the error of its second pose is; below 3 it may be the true one."""

    @property
    def deviation(self) -> float:
        """Of the target's origin in the camera's frame [m]."""
        J = np.hstack([np.eye(3), -skew(self.T_camera_target.t)])
        return float(np.sqrt(np.trace(J @ self.covariance @ J.T)))

    def rms(self, camera: CameraInfo) -> float:
        """Of the distances between the corners as seen and as projected [px]."""
        turn, place = cv2.Rodrigues(self.T_camera_target.R.copy())[0], self.T_camera_target.t.copy()
        projected = np.asarray(cv2.projectPoints(self.points, turn, place, camera.K, camera.D)[0], np.float64).reshape(-1, 2)
        return float(np.sqrt(np.mean(np.sum((projected - self.pixels) ** 2, axis=1))))


class Target(Protocol):
    """Something to look for."""

    @property
    def size(self) -> float:
        """Length of the axes that are drawn [m]."""
        ...

    def find(self, image: Image, camera: CameraInfo) -> tuple[list[Found], str]:
        """What an image (H, W, 3) shows, and where that is nothing, why."""
        ...


class LoneMarkers:
    """Each marker by itself."""

    def __init__(self, family: MarkerFamily) -> None:
        self._detector = Markers((family,)).build()
        self.size = 0.5 * family.size

    def find(self, image: Image, camera: CameraInfo) -> tuple[list[Found], str]:
        """Every marker's likelier pose."""
        detection = self._detector.detect(image, camera)
        found = [_lone(sighting) for sighting in detection.sightings]
        return found, _reasons("no marker", detection.rejected)


class MarkerSet:
    """Markers whose places are known: a board of markers, or the map of a room."""

    def __init__(self, name: str, markers: MarkerMap) -> None:
        sizes = {str(m.id): m.size for m in markers.markers.values()}
        first = next(iter(markers.markers.values()))
        self.name, self.size = name, first.size
        self._detector = Markers((MarkerFamily(markers.dictionary, first.size, sizes),)).build()
        self._field = MarkerField.empty(SE3())
        for marker in markers.markers.values():
            self._field.put(marker.id, marker.T_map_marker, marker.covariance)

    def find(self, image: Image, camera: CameraInfo) -> tuple[list[Found], str]:
        """The set, from all corners of all its markers."""
        detection = self._detector.detect(image, camera)
        known = self._field.known(detection.sightings)
        location = locate_camera(self._field, known, None)
        if location is None:
            return [], _reasons(
                f"{len(known)} of its markers seen, which do not tell one pose" if known else "no known marker", detection.rejected
            )
        points = np.concatenate([self._field.pose_of(s.id).transform(square(s.size)) for s in known])
        used, T = 4 * int(location.fits.sum()), location.T_map_camera.inverse()
        return [Found(self.name, T, location.covariance, points, _pixels(known), used)], ""


class SquaresBoard:
    """A ChArUco board or a chessboard."""

    def __init__(self, board: Board) -> None:
        self.board, self.size = board, board.square
        self._finder = BoardFinder(board)

    def find(self, image: Image, camera: CameraInfo) -> tuple[list[Found], str]:
        """The board, from the corners where its squares meet."""
        view = self._finder.find(image)
        if view is None:
            return [], "the picture is mirrored" if self._finder.mirrored(image) else "too few of its corners"
        location = locate_board(self.board, view, camera)
        if location is None:
            return [], f"{len(view.numbers)} of its corners, which do not tell one pose"
        points = self.board.corners[view.numbers]
        return [Found("board", location.T_map_camera.inverse(), location.covariance, points, view.pixels, int(location.fits.sum()))], ""


def _lone(sighting: Sighting) -> Found:
    points = square(sighting.size)
    pose = refined(Corners(points[None], sighting.rays[None], sighting.covariances[None]), sighting.branches[0].inverse())
    return Found(f"marker {sighting.id}", sighting.branches[0], pose.covariance, points, sighting.pixels, 4, sighting.ratio)


def _pixels(sightings: Sequence[Sighting]) -> FloatArray:
    return np.concatenate([s.pixels for s in sightings])


def _reasons(what: str, rejected: dict[str, int]) -> str:
    told = ", ".join(f"{count} {reason}" for reason, count in rejected.items())
    return f"{what} (not used: {told})" if told else what
