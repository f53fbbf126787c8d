"""What the camera of a robot is: its imagers, its modes, where it looks."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from hardware.errors import SpecError
from slam.messages import CameraInfo
from slam.se2 import FloatArray
from slam.se3 import SE3


@dataclass(frozen=True, slots=True)
class Imager:
    """One image sensor behind its lens. The centre of pixel (column i, row j) is at (i, j)."""

    width: int
    height: int
    focal: tuple[float, float]
    """Along rows and columns [px]."""
    centre: tuple[float, float]
    """Principal point: column, row [px]."""
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    """Brown-Conrady k1 k2 p1 p2 k3, in OpenCV's order."""
    row_time: float = 0.0
    """Time from row to row [s]; 0 for a global shutter."""

    def __post_init__(self) -> None:
        if min(self.width, self.height, *self.focal) <= 0 or self.row_time < 0.0:
            raise SpecError(f"an imager needs pixels and a focal length above 0 and a row time of 0 or above, got {self}")

    @property
    def K(self) -> FloatArray:
        """(3, 3) pinhole matrix [px]."""
        return np.array([[self.focal[0], 0.0, self.centre[0]], [0.0, self.focal[1], self.centre[1]], [0.0, 0.0, 1.0]])

    def row_times(self) -> FloatArray:
        """When each row (H,) is exposed, after the middle one [s]."""
        return self.row_time * (np.arange(self.height, dtype=np.float64) - 0.5 * (self.height - 1))

    def info(self, T_base_camera: SE3) -> CameraInfo:
        """What an image of this imager, mounted there, carries."""
        return CameraInfo(self.width, self.height, self.K, np.array(self.distortion), self.row_time, T_base_camera)


COLOUR_MODES = {(1920, 1080): 30, (1280, 720): 30, (960, 540): 60, (848, 480): 60, (640, 480): 60, (640, 360): 60, (424, 240): 60}
"""D435: width and height of a colour image -> fastest rate [1/s]."""
DEPTH_MODES = {(1280, 720): 0.28, (848, 480): 0.195, (640, 480): 0.175, (640, 360): 0.15, (480, 270): 0.12, (424, 240): 0.105}
"""D435: width and height of a depth image -> nearest depth [m]; up to 90 a second, at 1280 x 720 up to 30."""
_COLOUR_FOCAL = 612.0 / 480.0
"""Of the D435's colour lens, in picture heights."""
_COLOUR_READOUT = 1.0 / 60.0
"""Of all rows of a colour image [s]."""
_DEPTH_FOCAL = {(1280, 720): 640.0, (848, 480): 424.0, (640, 480): 384.0, (640, 360): 320.0, (480, 270): 240.0, (424, 240): 212.0}


@dataclass(frozen=True, slots=True)
class CameraSpec:
    """A colour imager and a stereo depth camera that looks its way; the defaults are the Intel RealSense D435 at 848 x 480."""

    model: str = "Intel RealSense D435"
    colour: Imager = field(default_factory=lambda: _colour_imager((848, 480)))
    depth: Imager = field(default_factory=lambda: _depth_imager((848, 480)))
    T_colour_depth: SE3 = field(default_factory=lambda: SE3.from_xyz_rpy((0.015, 0.0, 0.0)))
    """The depth camera, which is the left one of the stereo pair, in the optical frame of the colour camera."""
    baseline: float = 0.05
    """From the left to the right imager of the stereo pair [m]."""
    range_min: float = DEPTH_MODES[848, 480]
    """Nearest depth that is measured [m]."""
    period: float = 1.0 / 15.0
    """Time from image to image [s]."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.period) and self.period > 0.0 and self.baseline > 0.0 and self.range_min >= 0.0):
            raise SpecError(f"a camera needs a period and a baseline above 0 and a range_min of 0 or above, got {self}")


def d435(colour: tuple[int, int] = (848, 480), depth: tuple[int, int] = (848, 480), rate: int = 15) -> CameraSpec:
    """The D435 in one of its modes: sizes (width, height) and images a second.

    Raises:
        SpecError: it has no such mode.
    """
    for what, size, modes in (("colour", colour, COLOUR_MODES), ("depth", depth, DEPTH_MODES)):
        if size not in modes:
            available = ", ".join(f"{width} x {height}" for width, height in modes)
            raise SpecError(f"no {what} mode of {size[0]} x {size[1]}; available: {available}")
    fastest = min(COLOUR_MODES[colour], 30 if depth == (1280, 720) else 90)
    if rate not in (6, 15, 30, 60) or rate > fastest:
        raise SpecError(f"no rate of {rate} images a second; available: {', '.join(str(r) for r in (6, 15, 30, 60) if r <= fastest)}")
    return CameraSpec(colour=_colour_imager(colour), depth=_depth_imager(depth), range_min=DEPTH_MODES[depth], period=1.0 / rate)


def _colour_imager(size: tuple[int, int]) -> Imager:
    focal = _COLOUR_FOCAL * size[1]
    return Imager(*size, (focal, focal), _middle(size), row_time=_COLOUR_READOUT / size[1])


def _depth_imager(size: tuple[int, int]) -> Imager:
    return Imager(*size, (_DEPTH_FOCAL[size], _DEPTH_FOCAL[size]), _middle(size))


def _middle(size: tuple[int, int]) -> tuple[float, float]:
    return 0.5 * (size[0] - 1), 0.5 * (size[1] - 1)


def camera_mount(xyz: tuple[float, float, float], pitch_up: float) -> SE3:
    """`T_base_camera` of a camera that looks forward, pitched up by `pitch_up` [rad]; REP 103 optical axes."""
    optical = SE3(np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]))
    return SE3.from_xyz_rpy(xyz, (0.0, -pitch_up, 0.0)) @ optical
