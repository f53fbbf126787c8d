"""One marker as one image shows it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slam.messages import read_only
from slam.se2 import FloatArray
from slam.se3 import SE3

SIGNS = read_only([[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0]])


def square(size: float) -> FloatArray:
    """Corners (4, 3) [m] of a marker in its frame (x right, y up, z out of the print): top left, top right, bottom right, bottom left."""
    return 0.5 * size * SIGNS


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """A marker that was recognised; arrays are not written after they are made."""

    id: int
    size: float
    """Side of the black square [m]."""
    pixels: FloatArray
    """(4, 2) corners in the image, in the order of `square` [px]."""
    rays: FloatArray
    """(4, 2) x / z, y / z of the corners in the camera at the image's stamp: without distortion, without rolling shutter."""
    covariances: FloatArray
    """(4, 2, 2) of the rays."""
    branches: tuple[SE3, SE3]
    """`T_camera_marker`: the two poses in which a square looks like this, the one with the smaller error first."""
    chi2: tuple[float, float]
    """Squared reprojection errors of the branches over their variance: 8 numbers less 6 unknowns make 2 where the branch is right."""
    side: float
    """Mean length of a side in the image [px]."""
    blur: float
    """Standard deviation of the least sharp edge's slope [px]; nan where the corners do not come from fitted lines."""

    @property
    def weights(self) -> FloatArray:
        """Inverse covariances (4, 2, 2) of the rays."""
        return np.asarray(np.linalg.inv(self.covariances), dtype=np.float64)

    @property
    def ratio(self) -> float:
        """How many times larger the second branch's error is."""
        return self.chi2[1] / max(self.chi2[0], 1e-12)
