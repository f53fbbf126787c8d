"""The topics of a recording: their ROS 2 types, message definitions and layouts."""

from __future__ import annotations

from dataclasses import dataclass

from hardware.urdf import WHEELS

TRANSFORM = "i I s s 7d"
"""Layout of one geometry_msgs/TransformStamped: stamp, parent frame, child frame, translation and quaternion."""
JOINTS = tuple(f"{wheel}_joint" for wheel in WHEELS)
"""Names of the left and the right wheel's joint, as the URDF has them."""


@dataclass(frozen=True, slots=True)
class Topic:
    """One topic of a recording."""

    type: str
    """ROS 2 type."""
    layout: str
    """As `hardware.logs.cdr` has it."""
    latched: bool = False
    """Said once, and given to whoever comes later."""


_IMAGE = "i I s I I s B I B*"
_CAMERA_INFO = "i I s I I s d* 9d 9d 12d 6I B"

TOPICS: dict[str, Topic] = {
    "/robot_spec": Topic("std_msgs/msg/String", "s", latched=True),
    "/robot_description": Topic("std_msgs/msg/String", "s", latched=True),
    "/tf_static": Topic("tf2_msgs/msg/TFMessage", "I " + TRANSFORM, latched=True),
    "/tf": Topic("tf2_msgs/msg/TFMessage", "I " + TRANSFORM),
    "/joint_states": Topic("sensor_msgs/msg/JointState", "i I s s* d* d* d*"),
    "/odom": Topic("nav_msgs/msg/Odometry", "i I s s 85d"),
    "/imu": Topic("sensor_msgs/msg/Imu", "i I s 37d"),
    "/scan": Topic("sensor_msgs/msg/LaserScan", "i I s 7f f* f*"),
    "/camera/color/camera_info": Topic("sensor_msgs/msg/CameraInfo", _CAMERA_INFO),
    "/camera/depth/camera_info": Topic("sensor_msgs/msg/CameraInfo", _CAMERA_INFO),
    "/camera/color/image_raw": Topic("sensor_msgs/msg/Image", _IMAGE),
    "/camera/depth/image_rect_raw": Topic("sensor_msgs/msg/Image", _IMAGE),
    "/cmd_vel": Topic("geometry_msgs/msg/TwistStamped", "i I s 6d"),
    "/ground_truth": Topic("geometry_msgs/msg/PoseStamped", "i I s 7d"),
}

_VECTOR = ("float64 x", "float64 y", "float64 z")
_FIELDS: dict[str, tuple[str, ...]] = {
    "builtin_interfaces/Time": ("int32 sec", "uint32 nanosec"),
    "std_msgs/Header": ("builtin_interfaces/Time stamp", "string frame_id"),
    "std_msgs/String": ("string data",),
    "geometry_msgs/Vector3": _VECTOR,
    "geometry_msgs/Point": _VECTOR,
    "geometry_msgs/Quaternion": (*_VECTOR, "float64 w"),
    "geometry_msgs/Pose": ("geometry_msgs/Point position", "geometry_msgs/Quaternion orientation"),
    "geometry_msgs/PoseWithCovariance": ("geometry_msgs/Pose pose", "float64[36] covariance"),
    "geometry_msgs/PoseStamped": ("std_msgs/Header header", "geometry_msgs/Pose pose"),
    "geometry_msgs/Twist": ("geometry_msgs/Vector3 linear", "geometry_msgs/Vector3 angular"),
    "geometry_msgs/TwistWithCovariance": ("geometry_msgs/Twist twist", "float64[36] covariance"),
    "geometry_msgs/TwistStamped": ("std_msgs/Header header", "geometry_msgs/Twist twist"),
    "geometry_msgs/Transform": ("geometry_msgs/Vector3 translation", "geometry_msgs/Quaternion rotation"),
    "geometry_msgs/TransformStamped": ("std_msgs/Header header", "string child_frame_id", "geometry_msgs/Transform transform"),
    "tf2_msgs/TFMessage": ("geometry_msgs/TransformStamped[] transforms",),
    "nav_msgs/Odometry": (
        "std_msgs/Header header",
        "string child_frame_id",
        "geometry_msgs/PoseWithCovariance pose",
        "geometry_msgs/TwistWithCovariance twist",
    ),
    "sensor_msgs/JointState": ("std_msgs/Header header", "string[] name", "float64[] position", "float64[] velocity", "float64[] effort"),
    "sensor_msgs/Imu": (
        "std_msgs/Header header",
        "geometry_msgs/Quaternion orientation",
        "float64[9] orientation_covariance",
        "geometry_msgs/Vector3 angular_velocity",
        "float64[9] angular_velocity_covariance",
        "geometry_msgs/Vector3 linear_acceleration",
        "float64[9] linear_acceleration_covariance",
    ),
    "sensor_msgs/Image": (
        "std_msgs/Header header",
        "uint32 height",
        "uint32 width",
        "string encoding",
        "uint8 is_bigendian",
        "uint32 step",
        "uint8[] data",
    ),
    "sensor_msgs/RegionOfInterest": ("uint32 x_offset", "uint32 y_offset", "uint32 height", "uint32 width", "bool do_rectify"),
    "sensor_msgs/CameraInfo": (
        "std_msgs/Header header",
        "uint32 height",
        "uint32 width",
        "string distortion_model",
        "float64[] d",
        "float64[9] k",
        "float64[9] r",
        "float64[12] p",
        "uint32 binning_x",
        "uint32 binning_y",
        "sensor_msgs/RegionOfInterest roi",
    ),
    "sensor_msgs/LaserScan": (
        "std_msgs/Header header",
        "float32 angle_min",
        "float32 angle_max",
        "float32 angle_increment",
        "float32 time_increment",
        "float32 scan_time",
        "float32 range_min",
        "float32 range_max",
        "float32[] ranges",
        "float32[] intensities",
    ),
}


def definition(ros_type: str) -> str:
    """The type's message definition followed by those of all types it is made of, as MCAP's `ros2msg` wants it."""
    name = ros_type.replace("/msg/", "/")
    parts = ["\n".join(_FIELDS[name])]
    parts += [f"{'=' * 80}\nMSG: {part}\n" + "\n".join(_FIELDS[part]) for part in _parts(name, [])]
    return "\n".join(parts) + "\n"


def _parts(name: str, known: list[str]) -> list[str]:
    """Types that a type is made of, each once."""
    for field in _FIELDS[name]:
        part = field.split()[0].removesuffix("[]")
        if part in _FIELDS and part not in known:
            known.append(part)
            _parts(part, known)
    return known
