"""Robot specifications as text."""

import math

import pytest

from hardware.errors import SpecError
from hardware.logs.spec_file import parse_spec, read_spec, write_spec
from hardware.spec import LidarSpec, RobotSpec
from slam.se3 import SE3


def test_a_specification_comes_back_bit_for_bit():
    spec = RobotSpec(lidar=LidarSpec(T_base_laser=SE3.from_xyz_rpy((0.1, 0.2, 0.3), (math.pi, 0.1, 0.7))), imu=None)
    assert parse_spec(write_spec(spec)) == spec


def test_toml_gives_what_differs_from_the_defaults(tmp_path):
    file = tmp_path / "robot.toml"
    file.write_text('name = "upside down"\n[drive]\ntrack = 0.2\n[lidar.T_base_laser]\nxyz = [0.1, 0, 0]\nrpy = [3.0, 0, 0]\n')
    spec = read_spec(file)
    assert (spec.drive.track, spec.drive.counts_per_turn, spec.lidar.beams) == (0.2, 360, 682)
    assert spec.lidar.T_base_laser == SE3.from_xyz_rpy((0.1, 0.0, 0.0), (3.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("track = 1", "no field 'track'; there are name, drive"),
        ("[drive]\ntrac = 1", "no field 'trac'; there are wheel_radii, track"),
        ("[drive]\ntrack = 'wide'", r"Expected `float`, got `str` - at `\$.drive.track`"),
        ("[drive]\ntrack = -1", "finite and positive"),
        ("[lidar.T_base_laser]\nxyz = [1, 2]", "three numbers are right"),
        ("[drive", "not TOML"),
    ],
)
def test_a_wrong_specification_says_what_is_wrong(tmp_path, text, message):
    file = tmp_path / "robot.toml"
    file.write_text(text)
    with pytest.raises(SpecError, match=message):
        read_spec(file)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(SpecError, match=r"none\.toml: cannot be read: No such file"):
        read_spec(tmp_path / "none.toml")
