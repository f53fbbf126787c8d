"""Bags of other robots, written by `rosbags`, read as recordings."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from hardware.errors import RecordingError
from hardware.logs.registry import open_log
from hardware.logs.ros_bag import RosBag
from hardware.replay import Replay

ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
ROS1.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
BEAMS, EPOCH = 361, 1_700_000_000.0
MOUNT = (0.2, 0.05, 0.3), math.radians(90.0)


@dataclass
class Robot:
    """What goes into a bag."""

    odometry: str = "odometry"  # or "tf", "none"
    increment: float = math.radians(0.5)
    mounted: bool = True
    spoil: str = ""


def messages(robot, store):
    """(topic, type, time, message) of a robot that drives at 0.5 m/s for two seconds."""
    T = store.types
    Time, Header, Vector, Quaternion = (
        T[f"{name}"]
        for name in ("builtin_interfaces/msg/Time", "std_msgs/msg/Header", "geometry_msgs/msg/Vector3", "geometry_msgs/msg/Quaternion")
    )
    Point, Pose, PoseC = (T[f"geometry_msgs/msg/{name}"] for name in ("Point", "Pose", "PoseWithCovariance"))
    Twist, TwistC = T["geometry_msgs/msg/Twist"], T["geometry_msgs/msg/TwistWithCovariance"]
    Transform, Stamped = T["geometry_msgs/msg/Transform"], T["geometry_msgs/msg/TransformStamped"]

    def header(t, frame):
        stamp = Time(int(EPOCH + t), round((EPOCH + t) % 1 * 1e9))
        return Header(0, stamp, frame) if store is ROS1 else Header(stamp, frame)

    def turned(yaw):
        return Quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))

    def placed(t, parent, child, xyz, yaw):
        return Stamped(header(t, parent), child, Transform(Vector(*xyz), turned(yaw)))

    frames = "tf2_msgs/msg/TFMessage"
    if robot.mounted:
        yield "/tf_static", frames, 0.0, T[frames]([placed(0.0, "base_link", "laser", *MOUNT)])
    for k in range(21):
        t = 0.1 * k
        x = math.nan if robot.spoil == "pose" and k == 9 else 0.5 * t
        if robot.odometry == "odometry":
            pose, twist = Pose(Point(x, 0.0, 0.0), turned(0.0)), Twist(Vector(0.5, 0.0, 0.0), Vector(0.0, 0.0, 0.0))
            body = header(t, "odom"), "base_link", PoseC(pose, np.zeros(36)), TwistC(twist, np.zeros(36))
            yield "/odom", "nav_msgs/msg/Odometry", t, T["nav_msgs/msg/Odometry"](*body)
        elif robot.odometry == "tf":
            yield "/tf", frames, t, T[frames]([placed(t, "odom", "base_link", (x, 0.0, 0.0), 0.0)])
        first = -robot.increment * (BEAMS - 1) / 2
        fan = first, -first, robot.increment, 1e-4, 0.1, 0.05, 30.0
        ranges = np.arange(BEAMS, dtype=np.float32) * 0.01 + 1.0
        yield (
            "/front/scan",
            "sensor_msgs/msg/LaserScan",
            t,
            T["sensor_msgs/msg/LaserScan"](header(t, "laser"), *fan, ranges, np.zeros(0, np.float32)),
        )


def write1(path, robot=Robot()):  # noqa: B008
    with Writer1(path) as bag:
        connections = {}
        for topic, kind, t, message in messages(robot, ROS1):
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, kind, typestore=ROS1)
            bag.write(connections[topic], int((EPOCH + t) * 1e9), ROS1.serialize_ros1(message, kind))
    return path


def write2(path, robot=Robot(), storage=StoragePlugin.MCAP):  # noqa: B008
    with Writer2(path, version=8, storage_plugin=storage) as bag:
        connections = {}
        for topic, kind, t, message in messages(robot, ROS2):
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, kind, typestore=ROS2)
            bag.write(connections[topic], int((EPOCH + t) * 1e9), ROS2.serialize_cdr(message, kind))
    return path


WRITERS = {
    "rosbag1": lambda folder, robot: write1(folder / "robot.bag", robot),
    "rosbag2 mcap": lambda folder, robot: write2(folder / "bag", robot),
    "rosbag2 sqlite": lambda folder, robot: write2(folder / "bag", robot, StoragePlugin.SQLITE3),
    "bare mcap": lambda folder, robot: next(write2(folder / "bag", robot).glob("*.mcap")),
}


@pytest.fixture(params=WRITERS)
def make_bag(request, tmp_path):
    return lambda robot=Robot(): WRITERS[request.param](tmp_path, robot)  # noqa: B008


def of(log, channel):
    return [event.message for event in log.events() if event.channel == channel]


@pytest.mark.parametrize("odometry", ["odometry", "tf"])
def test_scans_odometry_and_mount_are_those_of_the_bag(make_bag, odometry):
    log = open_log(make_bag(Robot(odometry)))
    assert isinstance(log, RosBag)
    scans, wheels = of(log, "scans"), of(log, "odometry")
    assert (len(scans), len(wheels)) == (21, 21)
    assert scans[3].stamp == pytest.approx(EPOCH + 0.3, abs=1e-6)
    assert wheels[20].T_odom_base.x == pytest.approx(1.0)
    np.testing.assert_allclose(scans[0].T_base_laser.t, MOUNT[0])
    assert scans[0].T_base_laser.rpy()[2] == pytest.approx(MOUNT[1])
    np.testing.assert_allclose(np.diff(scans[0].angles), math.radians(0.5))
    assert (log.spec.lidar.beams, log.spec.lidar.range_max) == (BEAMS, 30.0)


def test_a_recording_without_odometry_is_a_robot_without_a_drive(make_bag):
    log = open_log(make_bag(Robot("none")))
    assert log.spec.drive is None
    assert log.spec.available == {"scans"}


def test_beams_that_are_told_clockwise_grow_with_the_angle_and_lie_where_they_lay(make_bag):
    clockwise = of(open_log(make_bag(Robot(increment=-math.radians(0.5)))), "scans")[0]
    assert (np.diff(clockwise.angles) > 0.0).all()
    direction = clockwise.T_base_laser.R @ [math.cos(clockwise.angles[0]), math.sin(clockwise.angles[0]), 0.0]
    told = math.radians(0.5) * (BEAMS - 1) / 2 + MOUNT[1]  # the first beam of a clockwise scan is the leftmost
    np.testing.assert_allclose(direction, [math.cos(told), math.sin(told), 0.0], atol=1e-6)


def test_a_laser_without_a_mount_is_said_to_sit_in_the_base(make_bag, caplog):
    scan = of(open_log(make_bag(Robot(mounted=False))), "scans")[0]
    np.testing.assert_array_equal(scan.T_base_laser.t, 0.0)
    assert "no transform from base_link to laser" in caplog.text


def test_a_bag_is_a_robot(make_bag):
    with Replay(make_bag()).build() as robot:
        frames = []
        while robot.clock.sleep_until(robot.clock.now() + 0.04):
            frames.append(robot.read())
    assert sum(len(frame.scans) for frame in frames) == 21


def test_a_pose_that_is_none_is_named(make_bag):
    with pytest.raises(RecordingError, match=r"message \d+, on /odom: the transform .* is none"):
        open_log(make_bag(Robot(spoil="pose")))


def test_a_bag_without_scans_says_what_it_has(tmp_path):
    with Writer2(tmp_path / "bag", version=8) as bag:
        kind = "std_msgs/msg/String"
        bag.write(bag.add_connection("/chatter", kind, typestore=ROS2), 1, ROS2.serialize_cdr(ROS2.types[kind]("hello"), kind))
    with pytest.raises(RecordingError, match=r"no sensor_msgs/LaserScan in it; it has /chatter \(std_msgs/msg/String\)"):
        open_log(tmp_path / "bag")


@pytest.mark.parametrize("kept", [0.2, 0.6, 0.95])
def test_a_bag_that_is_cut_is_refused_in_one_line(tmp_path, kept):
    path = write1(tmp_path / "robot.bag")
    whole = path.read_bytes()
    path.write_bytes(whole[: int(kept * len(whole))])
    with pytest.raises(RecordingError) as refusal:
        open_log(path)
    assert "\n" not in str(refusal.value)
