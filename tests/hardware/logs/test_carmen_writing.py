from dataclasses import replace

import numpy as np
import pytest

from hardware.errors import SpecError
from hardware.logs.carmen_writing import carmen_lines
from hardware.logs.registry import open_log
from hardware.spec import LidarSpec, RobotSpec
from slam.se3 import SE3


def test_a_log_that_was_written_says_the_same_when_it_is_read(make_body, tmp_path):
    log, path = make_body().log, tmp_path / "drive.log"
    path.write_text("\n".join(carmen_lines(log)) + "\n", encoding="ascii")
    for channel in ("odometry", "scans"):
        written, read = ([event.message for event in one.events() if event.channel == channel] for one in (log, open_log(path)))
        assert [message.stamp for message in read] == pytest.approx([message.stamp for message in written], abs=1e-6)
    assert read[0].angles == pytest.approx(written[0].angles, abs=1e-6)
    assert read[0].T_base_laser.t[:2] == pytest.approx(written[0].T_base_laser.t[:2])
    finite = np.isfinite(written[0].ranges)
    assert read[0].ranges[finite] == pytest.approx(written[0].ranges[finite], abs=1e-5)
    assert not np.any(np.isfinite(read[0].ranges[~finite]))


@pytest.mark.parametrize(
    ("mount", "words"),
    [
        (SE3.from_xyz_rpy((0.1, 0.0, 0.2), (0.3, 0.0, 0.0)), "level, upright lidar"),
        (SE3.from_xyz_rpy((0.1, 0.02, 0.2), (0.0, 0.0, 0.0)), "long axis"),
        (None, "level, upright lidar"),
    ],
)
def test_a_mount_that_the_format_cannot_tell_of_is_an_error(make_body, mount, words):
    lidar = None if mount is None else replace(LidarSpec(), T_base_laser=mount)
    with pytest.raises(SpecError, match=words):
        next(carmen_lines(make_body(spec=RobotSpec(lidar=lidar)).log))
