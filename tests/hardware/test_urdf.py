import math
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from hardware import chassis
from hardware.chassis import Part, combined
from hardware.errors import SpecError
from hardware.spec import DriveSpec, RobotSpec
from hardware.urdf import urdf
from slam.se3 import SE3


def parsed(spec=None):
    return ET.fromstring(urdf(spec or RobotSpec()))


def origin(element):
    node = element.find("origin")
    return SE3.from_xyz_rpy(*(tuple(float(v) for v in node.attrib[key].split()) for key in ("xyz", "rpy")))


def close(a, b):
    return np.allclose(a.matrix(), b.matrix(), atol=1e-8)


def test_links_are_the_frames_of_the_spec():
    names = [link.attrib["name"] for link in parsed().iter("link")]
    assert names == ["base", "wheel_left", "wheel_right", "caster", "laser", "camera", "imu"]


def test_mounts_are_those_of_the_spec():
    spec = RobotSpec()
    joints = {joint.find("child").attrib["link"]: origin(joint) for joint in parsed(spec).iter("joint")}
    assert close(joints["laser"], spec.lidar.T_base_laser)
    assert close(joints["imu"], spec.imu.T_base_imu)
    assert close(joints["camera"], spec.T_base_camera)


def test_wheels_are_those_of_the_spec():
    robot = parsed(replace(RobotSpec(), drive=DriveSpec(wheel_radii=(0.03, 0.029), track=0.14)))
    places = {joint.attrib["name"]: origin(joint).t for joint in robot.iter("joint")}
    assert places["wheel_left_joint"] == pytest.approx([0.0, 0.07, 0.0295])
    assert places["wheel_right_joint"] == pytest.approx([0.0, -0.07, 0.0295])
    radii = [
        float(robot.find(f"link[@name='{name}']/collision/geometry/sphere").attrib["radius"]) for name in ("wheel_left", "wheel_right")
    ]
    assert radii == [0.03, 0.029]


def test_wheels_turn_about_y():
    assert [joint.find("axis").attrib["xyz"] for joint in parsed().iter("joint") if joint.attrib["type"] == "continuous"] == [
        "0 1 0",
        "0 1 0",
    ]


def test_every_link_has_a_positive_mass_and_inertia():
    for link in parsed().iter("link"):
        assert float(link.find("inertial/mass").attrib["value"]) > 0.0
        i = {axis: float(value) for axis, value in link.find("inertial/inertia").attrib.items()}
        tensor = np.array([[i["ixx"], i["ixy"], i["ixz"]], [i["ixy"], i["iyy"], i["iyz"]], [i["ixz"], i["iyz"], i["izz"]]])
        principal = np.linalg.eigvalsh(tensor)
        assert np.all(principal > 0.0)
        assert principal[2] <= principal[0] + principal[1] + 1e-12


def test_the_robot_weighs_what_its_parts_weigh():
    mass = sum(float(link.find("inertial/mass").attrib["value"]) for link in parsed().iter("link"))
    assert 0.7 < mass < 1.0


def test_a_sensor_that_is_missing_has_no_link():
    names = {link.attrib["name"] for link in parsed(RobotSpec(lidar=None, imu=None)).iter("link")}
    assert names.isdisjoint({"laser", "imu"})


def test_a_robot_without_a_drive_has_no_urdf():
    with pytest.raises(SpecError, match="drive"):
        urdf(RobotSpec(drive=None))


def test_the_robot_stands_within_its_radius_and_on_its_three_feet():
    (x, y, _), (cx, cy, _) = chassis.HULL_SIZE, chassis.HULL_CENTRE
    assert math.hypot(abs(cx) + x / 2, abs(cy) + y / 2) < RobotSpec().radius
    _, centre, _ = combined(chassis.BODY)
    assert chassis.CASTER_CENTRE[0] < centre[0] < 0.0


def test_two_halves_weigh_as_the_whole():
    whole = Part("whole", (0.4, 0.2, 0.1), 2.0, chassis.WHITE, (0.1, 0.2, 0.3))
    halves = tuple(Part("half", (0.2, 0.2, 0.1), 1.0, chassis.WHITE, (0.1 + side * 0.1, 0.2, 0.3)) for side in (-1, 1))
    mass, centre, inertia = combined(halves)
    assert mass == 2.0
    assert centre == pytest.approx(whole.centre)
    assert inertia == pytest.approx(whole.inertia())
