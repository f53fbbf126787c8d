"""How far the twin's body and devices are from what their specification says."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from hardware.errors import SpecError
from hardware.spec import RobotSpec


@dataclass(frozen=True, slots=True)
class Realism:
    """Errors of body and devices; the defaults are none."""

    radius_errors: tuple[float, float] = (0.0, 0.0)
    """True over specified wheel radius, minus 1: left, right."""
    track_error: float = 0.0
    """True over specified track, minus 1."""
    range_sigma: float = 0.0
    """Standard deviation of near ranges [m]."""
    range_sigma_share: float = 0.0
    """Standard deviation of far ranges, as a share of the range."""
    gyro_bias_sigma: float = 0.0
    """Standard deviation of the gyro's bias, drawn at every reset [rad/s]."""
    gyro_sigma: float = 0.0
    """Standard deviation of one gyro reading [rad/s]."""

    def true_spec(self, spec: RobotSpec) -> RobotSpec:
        """The body as it really is.

        Raises:
            SpecError: the robot has no drive.
        """
        if spec.drive is None:
            raise SpecError("the twin drives on wheels; give the spec a `drive`")
        left, right = (radius * (1.0 + error) for radius, error in zip(spec.drive.wheel_radii, self.radius_errors, strict=True))
        drive = replace(spec.drive, wheel_radii=(left, right), track=spec.drive.track * (1.0 + self.track_error))
        return replace(spec, drive=drive)


REALISMS: dict[str, Realism] = {
    "ideal": Realism(),
    "datasheet": Realism(
        radius_errors=(0.005, -0.003),
        track_error=0.01,
        # URG-04LX-UG01: +-30 mm to 1 m, +-3 % beyond, read as three sigma.
        range_sigma=0.010,
        range_sigma_share=0.01,
        # The EV3 gyro reports whole deg/s: rounding alone is 0.29 deg/s; the bias is what its rest calibration leaves.
        gyro_bias_sigma=math.radians(0.1),
        gyro_sigma=math.radians(0.5),
    ),
}
"""name -> errors. `datasheet` is the default robot."""
