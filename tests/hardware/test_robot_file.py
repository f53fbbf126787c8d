import pytest

from hardware.drivers.ev3 import Ev3Ports
from hardware.errors import SpecError
from hardware.logs.spec_file import read_spec
from hardware.robot_file import read_robot_file, update_robot_file
from hardware.spec import RobotSpec


@pytest.fixture
def file(tmp_path):
    return tmp_path / "robot.toml"


def test_ports_and_specification_stand_in_one_file(file):
    file.write_text('[ports]\nleft = "B"\nright = "C"\ngyro = 2\nreversed = true\n[drive]\ntrack = 0.13\n')
    robot = read_robot_file(file)
    assert robot.ports == Ev3Ports("B", "C", 2, True)
    assert robot.spec.drive.track == 0.13
    assert read_spec(file) == robot.spec


def test_an_update_leaves_the_rest_as_it_was(file):
    file.write_text(
        'name = "fred"\n[ports]\nleft = "B"\n[lidar]\nT_base_laser = {xyz = [0.1, 0, 0.2], rpy = [0, 0, 0]}\n[drive]\nmax_speed = 0.2\n'
    )
    update_robot_file(file, {"drive": {"track": 0.125}, "lidar": {"T_base_laser": {"xyz": [0.0, 0.0, 0.3]}}})
    robot = read_robot_file(file)
    assert (robot.spec.name, robot.ports.left, robot.spec.drive.max_speed, robot.spec.drive.track) == ("fred", "B", 0.2, 0.125)
    assert robot.spec.lidar.T_base_laser.t.tolist() == [0.0, 0.0, 0.3]


def test_an_update_begins_a_file_that_is_missing(file):
    update_robot_file(file, {"drive": {"wheel_radii": [0.0281, 0.0279]}})
    assert read_robot_file(file).spec.drive.wheel_radii == (0.0281, 0.0279)
    assert read_robot_file(file).ports == Ev3Ports()


def test_an_impossible_update_leaves_the_file_alone(file):
    file.write_text("[drive]\ntrack = 0.13\n")
    with pytest.raises(SpecError):
        update_robot_file(file, {"drive": {"track": -1.0}})
    assert file.read_text() == "[drive]\ntrack = 0.13\n"
    assert list(file.parent.iterdir()) == [file]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[ports]\nleft = "X"\n', "A to D"),
        ("[ports]\nmiddle = 1\n", "no port 'middle'"),
        ("[ports]\ngyro = 'x'\n", "ports"),
        ("ports = 3\n", "ports"),
        ("[drive]\nwheels = 3\n", "no field 'wheels'"),
        ("drive = ", "not TOML"),
    ],
)
def test_mistakes_are_named(file, text, words):
    file.write_text(text)
    with pytest.raises(SpecError, match=words):
        read_robot_file(file)


def test_a_file_that_is_not_there_or_cannot_be_written_is_an_error(file, tmp_path):
    with pytest.raises(SpecError, match="cannot be read"):
        read_robot_file(file)
    with pytest.raises(SpecError, match="cannot be written"):
        update_robot_file(tmp_path / "nowhere" / "robot.toml", {"drive": {"track": 0.1}})


def test_an_empty_file_is_the_robot_of_this_project(file):
    file.write_text("")
    assert read_robot_file(file).spec == RobotSpec()
