"""`poses.csv` and pictures with axes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from scripts.calibrations.sources import Picture
from scripts.locating.targets import Found
from scripts.runs.files import write_text, write_via
from slam.messages import CameraInfo
from slam.se3 import SE3

COLUMNS = "picture,what,in,x,y,z,qx,qy,qz,qw,rx,ry,rz,deviation_m,corners,used,rms_px,ratio"
SEEN = (40, 200, 255)
"""Colour of corners [blue, green, red]."""


def rows_of(picture: str, found: Found, camera: CameraInfo, mapped: bool) -> list[str]:
    """Lines of the table: the thing in the camera's frame and, if it is a `mapped` set, the camera in its frame.

    Metres, quaternion and rotation vector (OpenCV's `rvec`; its `tvec` is x, y, z).
    """
    T = found.T_camera_target
    ratio = "" if np.isnan(found.ratio) else f"{found.ratio:.4g}"
    rest = f"{found.deviation:.6f},{len(found.points)},{found.used},{found.rms(camera):.4f},{ratio}"
    rows = [f"{picture},{found.name},camera,{_numbers(T)},{rest}"]
    return [*rows, f"{picture},camera,{found.name},{_numbers(T.inverse())},{rest}"] if mapped else rows


def write_poses(path: Path, rows: Sequence[str]) -> None:
    """Write the table.

    Raises:
        OutputError: the file cannot be written.
    """
    write_text(path, "\n".join([COLUMNS, *rows]) + "\n")


def write_axes_png(path: Path, picture: Picture, camera: CameraInfo, found: Sequence[Found], length: float) -> None:
    """Write the picture with the corners that were seen and each thing's axes: x red, y green, z blue.

    Raises:
        OutputError: the file cannot be written.
    """
    drawn = cv2.cvtColor(picture.image, cv2.COLOR_RGB2BGR)
    thick = max(1, round(picture.image.shape[1] / 320))
    for thing in found:
        for u, v in np.rint(thing.pixels).astype(int).tolist():
            cv2.circle(drawn, (u, v), thick + 1, SEEN, 1, cv2.LINE_AA)
        T = thing.T_camera_target
        cv2.drawFrameAxes(drawn, camera.K, camera.D, cv2.Rodrigues(T.R.copy())[0], T.t.copy(), length, thick)
    coded = cv2.imencode(".png", drawn)[1].tobytes()
    write_via(path, lambda partial: partial.write_bytes(coded))


def _numbers(T: SE3) -> str:
    turn = np.asarray(cv2.Rodrigues(T.R.copy())[0], np.float64).reshape(3)
    return ",".join(f"{value:.7f}" for value in (*T.t.tolist(), *T.quaternion().tolist(), *turn.tolist()))
