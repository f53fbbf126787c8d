"""RobotSpec -> URDF: the twin loads it, recordings carry it.

Links: `base` (the axle's midpoint on the floor, x forward), `wheel_left`, `wheel_right` (turn about y), `caster`,
`laser`, `camera` (optical frame: z forward, x right, y down), `imu`.
"""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np

from hardware import chassis
from hardware.chassis import Part, Vector
from hardware.errors import SpecError
from hardware.spec import DriveSpec, RobotSpec
from slam.se2 import FloatArray
from slam.se3 import SE3

WHEELS = ("wheel_left", "wheel_right")
FRICTION = {"base": 0.3, "wheel_left": 0.9, "wheel_right": 0.9, "caster": 0.05}
"""Lateral friction of what touches: ABS plastic, rubber tyres, a steel ball."""


def urdf(spec: RobotSpec) -> str:
    """URDF text of the robot; wheels touch the floor in one point each (a sphere), the rest bumps as one box.

    Raises:
        SpecError: the robot has no drive.
    """
    if spec.drive is None:
        raise SpecError("a robot without a drive has no URDF; give the spec a `drive`")
    robot = ET.Element("robot", name=spec.name)
    _add_base(robot)
    _add_wheels(robot, spec.drive)
    _add_caster(robot)
    if spec.lidar is not None:
        _add_sensor(robot, "laser", spec.lidar.T_base_laser, chassis.LIDAR)
    optical = SE3(np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]))
    _add_sensor(robot, "camera", spec.T_base_camera, chassis.CAMERA, optical)
    if spec.imu is not None:
        _add_sensor(robot, "imu", spec.imu.T_base_imu, chassis.GYRO)
    ET.indent(robot)
    return ET.tostring(robot, encoding="unicode") + "\n"


def _add_base(robot: ET.Element) -> None:
    link = ET.SubElement(robot, "link", name="base")
    mass, centre, inertia = chassis.combined(chassis.BODY)
    _add_inertial(link, mass, inertia, SE3(t=centre))
    for part in chassis.BODY:
        _add_box(link, "visual", part.size, SE3(t=np.array(part.centre)), part)
    _add_box(link, "collision", chassis.HULL_SIZE, SE3(t=np.array(chassis.HULL_CENTRE)))
    _add_friction(link)


def _add_wheels(robot: ET.Element, drive: DriveSpec) -> None:
    axle = 0.5 * sum(drive.wheel_radii)
    for name, radius, y in zip(WHEELS, drive.wheel_radii, (0.5 * drive.track, -0.5 * drive.track), strict=True):
        link = ET.SubElement(robot, "link", name=name)
        spin = 0.5 * chassis.WHEEL_MASS * radius**2
        tilt = 0.5 * spin + chassis.WHEEL_MASS * chassis.WHEEL_WIDTH**2 / 12.0
        _add_inertial(link, chassis.WHEEL_MASS, np.diag([tilt, spin, tilt]), SE3())
        visual = _add_shape(link, "visual", SE3.from_xyz_rpy((0.0, 0.0, 0.0), (np.pi / 2, 0.0, 0.0)))
        ET.SubElement(visual[0], "cylinder", radius=f"{radius:.9g}", length=f"{chassis.WHEEL_WIDTH:.9g}")
        _add_colour(visual[1], "tyre", chassis.BLACK)
        _add_sphere(link, radius)
        _add_friction(link)
        joint = _add_joint(robot, name, "continuous", SE3.from_xyz_rpy((0.0, y, axle)))
        ET.SubElement(joint, "axis", xyz="0 1 0")


def _add_caster(robot: ET.Element) -> None:
    link = ET.SubElement(robot, "link", name="caster")
    _add_inertial(link, chassis.CASTER_MASS, np.eye(3) * 0.4 * chassis.CASTER_MASS * chassis.CASTER_RADIUS**2, SE3())
    visual = _add_shape(link, "visual", SE3())
    ET.SubElement(visual[0], "sphere", radius=f"{chassis.CASTER_RADIUS:.9g}")
    _add_colour(visual[1], "ball", chassis.LIGHT_GREY)
    _add_sphere(link, chassis.CASTER_RADIUS)
    _add_friction(link)
    _add_joint(robot, "caster", "fixed", SE3(t=np.array(chassis.CASTER_CENTRE)))


def _add_sensor(robot: ET.Element, name: str, T_base_sensor: SE3, part: Part, T_sensor_part: SE3 | None = None) -> None:
    link = ET.SubElement(robot, "link", name=name)
    T_sensor_part = (T_sensor_part or SE3()) @ SE3(t=np.array(part.centre))
    _add_inertial(link, part.mass, part.inertia(), T_sensor_part)
    _add_box(link, "visual", part.size, T_sensor_part, part)
    _add_joint(robot, name, "fixed", T_base_sensor)


def _add_joint(robot: ET.Element, child: str, kind: str, T_base_child: SE3) -> ET.Element:
    joint = ET.SubElement(robot, "joint", name=f"{child}_joint", type=kind)
    ET.SubElement(joint, "parent", link="base")
    ET.SubElement(joint, "child", link=child)
    _add_origin(joint, T_base_child)
    return joint


def _add_inertial(link: ET.Element, mass: float, inertia: FloatArray, T_link_inertia: SE3) -> None:
    inertial = ET.SubElement(link, "inertial")
    _add_origin(inertial, T_link_inertia)
    ET.SubElement(inertial, "mass", value=f"{mass:.9g}")
    axes = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    entries = zip(axes, inertia[np.triu_indices(3)], strict=True)
    ET.SubElement(inertial, "inertia", {axis: f"{value:.9g}" for axis, value in entries})


def _add_box(link: ET.Element, kind: str, size: Vector, T_link_box: SE3, part: Part | None = None) -> None:
    shape = _add_shape(link, kind, T_link_box)
    ET.SubElement(shape[0], "box", size=_text(size))
    if part is not None:
        _add_colour(shape[1], part.name, part.colour)


def _add_sphere(link: ET.Element, radius: float) -> None:
    ET.SubElement(_add_shape(link, "collision", SE3())[0], "sphere", radius=f"{radius:.9g}")


def _add_shape(link: ET.Element, kind: str, T_link_shape: SE3) -> tuple[ET.Element, ET.Element]:
    """The geometry element of a new shape, and the shape."""
    shape = ET.SubElement(link, kind)
    _add_origin(shape, T_link_shape)
    return ET.SubElement(shape, "geometry"), shape


def _add_colour(shape: ET.Element, name: str, colour: Vector) -> None:
    material = ET.SubElement(shape, "material", name=name)
    ET.SubElement(material, "color", rgba=f"{_text(colour)} 1")


def _add_friction(link: ET.Element) -> None:
    contact = ET.SubElement(link, "contact")
    ET.SubElement(contact, "lateral_friction", value=f"{FRICTION[link.attrib['name']]:.9g}")


def _add_origin(element: ET.Element, T: SE3) -> None:
    ET.SubElement(element, "origin", xyz=_text(T.t), rpy=_text(T.rpy()))


def _text(values: Vector | FloatArray) -> str:
    return " ".join(f"{value + 0.0:.9g}" for value in values)  # + 0.0 turns -0 into 0
