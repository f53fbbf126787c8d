"""How far the camera is from a perfect one: every number of it. The sources are in docs/camera.md."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class CameraErrors:
    """Errors of the camera; the defaults are none. Shutter, distortion and the place of the imagers are its specification."""

    exposure: float = 0.0
    """Of a row of the colour image [s]: what moves meanwhile is blurred."""
    read_noise: float = 0.0
    """Standard deviation of a colour in the dark, of 255."""
    shot_noise: float = 0.0
    """Growth of the colour's variance with the colour."""
    subpixel: float = 0.0
    """Standard deviation of the stereo match [px]: the depth's is z^2 subpixel / (focal length x baseline)."""
    patch: float = 0.0
    """Size of the patches in which errors of the match are alike [px]."""
    disparity_steps: float = 0.0
    """Steps of the disparity in a pixel; 0: any."""
    occlusion: float = 0.0
    """1: what the right imager cannot see is not measured, 0: it is."""
    range_max: float = 65.5
    """Farthest depth that is measured [m]."""
    lost_matte: float = 0.0
    """Share of pixels without depth on a matte surface."""
    lost_dark: float = 0.0
    """The same on a dark surface."""
    lost_glossy: float = 0.0
    """The same on a glossy surface."""
    lost_glass: float = 0.0
    """The same on glass."""


DATASHEET = CameraErrors(
    exposure=0.008,
    read_noise=1.2,
    shot_noise=0.03,
    subpixel=0.08,
    patch=1.5,
    disparity_steps=32.0,
    occlusion=1.0,
    range_max=10.0,
    lost_matte=0.005,
    lost_dark=0.6,
    lost_glossy=0.4,
    lost_glass=0.9,
)
HARSH = CameraErrors(
    exposure=0.016,
    read_noise=3.0,
    shot_noise=0.08,
    subpixel=0.16,
    patch=2.5,
    disparity_steps=32.0,
    occlusion=1.0,
    range_max=6.0,
    lost_matte=0.03,
    lost_dark=0.9,
    lost_glossy=0.7,
    lost_glass=0.97,
)
