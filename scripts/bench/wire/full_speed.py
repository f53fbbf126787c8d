"""A client to be killed: drives straight ahead at full speed, and says when it does."""

from __future__ import annotations

import sys

from hardware.ev3_robot import Ev3
from hardware.spec import DriveSpec
from slam.messages import Twist

PERIOD = 0.03
"""[s]"""
FULL = 0.95
"""Share of the commanded speed that is full speed."""


def main(brick: str) -> None:
    """Drive until killed; one line is said at full speed."""
    said = False
    with Ev3(ev3=brick, lidar="").build() as robot:
        drive = robot.spec.drive or DriveSpec()
        while True:
            told = robot.drive(Twist(drive.max_speed, 0.0))
            odometry = robot.queues["odometry"].latest
            if not said and odometry is not None and odometry.twist is not None and odometry.twist.v > FULL * told.v:
                print("at full speed", flush=True)
                said = True
            robot.clock.sleep_until(robot.clock.now() + PERIOD)


if __name__ == "__main__":
    main(sys.argv[1])
