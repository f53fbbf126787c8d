"""What an image should show: the door to the camera's truth, for the images of the last second."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hardware.camera_spec import Imager
from sim.errors import TruthError
from sim.raster.kernels.views import Views
from sim.raster.lens import project
from sim.raster.painter import RasterPainter
from sim.simulation import Simulation
from slam.se2 import FloatArray
from worlds.parts import Marker

REMEMBERED = 0.9
"""How long the twin knows where everything was [s]."""
SEEN = 0.95
"""Share of a marker's black square that must be seen."""
ROUNDS = 5
"""Of the search for the row, and with it the moment, in which a point is seen."""


class CameraTruth:
    """What is really before the camera of a twin.

    Raises:
        TruthError: the twin's camera is off.
    """

    def __init__(self, simulation: Simulation) -> None:
        if simulation.scenery is None:
            raise TruthError("the twin's camera is off; build it with a camera such as camera='raster'")
        self._simulation = simulation
        self._scenery = simulation.scenery
        self._painter = RasterPainter(self._scenery.faces, self._scenery.light)
        self._camera = simulation.spec.require_camera()
        self._infos = simulation.spec.camera_infos()

    def markers(self, stamp: float) -> dict[int, FloatArray]:
        """Corners (4, 2) [px] of every marker that the colour image of a stamp [s] shows unhidden; in the order of `Marker.corners`.

        Each corner is where its row sees it at that row's own time.

        Raises:
            TruthError: the stamp is not within the last second.
        """
        views = self._views(stamp)
        ids = self._painter.see(self._camera.colour, views)
        found: dict[int, FloatArray] = {}
        for face, marker in self._scenery.marker_faces(self._simulation.world):
            corners = seen_corners(marker, face, self._camera.colour, views, ids)
            if corners is not None:
                found[marker.id] = corners
        return found

    def depth(self, stamp: float) -> NDArray[np.float32]:
        """True depth (H, W) [m] in the depth image of a stamp [s]; nan where there is nothing.

        Raises:
            TruthError: the stamp is not within the last second.
        """
        self._check(stamp)
        imager, mount = self._camera.depth, self._infos[1].T_base_camera
        views = self._scenery.views(self._simulation.motion, mount, np.array([stamp]))
        depth = self._painter.depths(imager, views, self._painter.see(imager, views))
        return np.where(depth > 0.0, depth, np.float32(np.nan))

    def people(self, stamp: float) -> NDArray[np.int32]:
        """Number in `World.people` of the person that each pixel (H, W) of the colour image of a stamp [s] sees; -1: none.

        Raises:
            TruthError: the stamp is not within the last second.
        """
        ids = self._painter.see(self._camera.colour, self._views(stamp))
        return self._scenery.people_of(ids)

    def _views(self, stamp: float) -> Views:
        self._check(stamp)
        return self._scenery.views(self._simulation.motion, self._infos[0].T_base_camera, stamp + self._camera.colour.row_times())

    def _check(self, stamp: float) -> None:
        latest = self._simulation.motion.end
        if not max(latest - REMEMBERED, 0.0) <= stamp <= latest:
            raise TruthError(
                f"the camera's truth at {stamp} s is not known; it is from {max(latest - REMEMBERED, 0.0):.3f} to {latest:.3f} s"
            )


def seen_corners(marker: Marker, face: int, imager: Imager, views: Views, ids: NDArray[np.int32]) -> FloatArray | None:
    """Corners (4, 2) [px] of a marker that the picture shows whole and unhidden.

    Args:
        marker: the marker.
        face: number of its print's face.
        imager: of the picture.
        views: of its rows.
        ids: (H, W) face that each pixel sees.
    """
    corners = _projected(marker, imager, views)
    if corners is None or not ((corners >= 0.0) & (corners <= (imager.width - 1, imager.height - 1))).all():
        return None
    return corners if np.mean(_inside(corners, ids) == face) >= SEEN else None


def _projected(marker: Marker, imager: Imager, views: Views) -> FloatArray | None:
    """Corners (4, 2) [px] of a marker that faces the camera, each where its row sees it."""
    R, o = views[0][0], views[1][0]
    rows, last = np.full(4, 0.5 * (imager.height - 1)), len(R) - 1
    pixels = np.zeros((4, 2))
    for _ in range(ROUNDS):
        places = np.clip(rows, 0.0, float(last))
        k = np.minimum(places.astype(np.int64), max(last - 1, 0))
        f, after = (places - k)[:, None], np.minimum(k + 1, last)
        eyes, turns = (1.0 - f) * o[k] + f * o[after], (1.0 - f[:, None]) * R[k] + f[:, None] * R[after]
        points = np.einsum("nij,nj->ni", turns, marker.corners() - eyes)
        if points[:, 2].min() <= 0.0 or _normal(marker) @ (eyes[0] - marker.corners()[0]) <= 0.0:
            return None
        pixels = project(imager, points)
        rows = pixels[:, 1]
    return pixels


def _normal(marker: Marker) -> FloatArray:
    return np.array([np.cos(marker.yaw), np.sin(marker.yaw), 0.0])


def _inside(corners: FloatArray, ids: NDArray[np.int32]) -> NDArray[np.int32]:
    """What the pixels (N,) inside a quadrilateral see."""
    share = np.linspace(0.02, 0.98, 24)
    weights = np.array(
        [np.outer(p, q).ravel() for p, q in ((1 - share, 1 - share), (1 - share, share), (share, share), (share, 1 - share))]
    )
    columns, rows = np.rint(weights.T @ corners).astype(np.int64).T
    return ids[rows, columns]
