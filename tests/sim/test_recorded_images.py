"""A twin's images through a recording: back to us bit for bit, and to another reader of rosbag2."""

import hashlib

import numpy as np
import pytest
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from hardware.camera_spec import d435
from hardware.recorder import Recorder
from hardware.replay import Replay
from hardware.spec import RobotSpec
from hardware.urdf import urdf
from sim.robot import Sim
from slam.messages import Twist

TYPES = get_typestore(Stores.ROS2_HUMBLE)
FRAMES = {"color": "camera", "depth": "camera_depth"}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Images of a twin among people, and the folder in which they were recorded."""
    folder, images = tmp_path_factory.mktemp("recorded"), []
    body = Sim(world="office:people=3", camera="raster", spec=RobotSpec(camera=d435((424, 240), (424, 240)))).build()
    with body as robot, Recorder(robot, folder, urdf(robot.spec)) as recorder:
        for tick in range(17):
            robot.clock.sleep_until(0.05 * tick)
            images += robot.read().images
            robot.drive(Twist(0.1, 0.8))
            recorder.flush()
    return folder, images


@pytest.fixture(scope="module")
def messages(recorded):
    """Messages of each camera topic as rosbags reads them."""
    found = {}
    with Reader(recorded[0]) as reader:
        for connection, _, content in reader.messages():
            if connection.topic.startswith("/camera/"):
                found.setdefault(connection.topic, []).append(TYPES.deserialize_cdr(content, connection.msgtype))
    return found


def digest(image):
    """SHA-256 of all that an image says."""
    result = hashlib.sha256(np.float64(image.stamp).tobytes() + image.colour.tobytes() + image.depth.tobytes())
    for info in (image.colour_info, image.depth_info):
        result.update(repr((info.width, info.height, info.row_time)).encode() + info.K.tobytes() + info.D.tobytes())
        result.update(info.T_base_camera.R.tobytes() + info.T_base_camera.t.tobytes())
    return result.hexdigest()


def test_a_replay_gives_the_images_back_bit_for_bit(recorded):
    folder, images = recorded
    replayed = []
    with Replay(folder).build() as replay:
        while replay.clock.sleep_until(np.inf):
            replayed += replay.read().images
        replayed += replay.read().images
    assert len(images) >= 8
    assert [digest(image) for image in replayed][: len(images)] == [digest(image) for image in images]


@pytest.mark.parametrize(("name", "encoding"), [("color/image_raw", "rgb8"), ("depth/image_rect_raw", "16UC1")])
def test_rosbags_reads_the_images(recorded, messages, name, encoding):
    read = messages[f"/camera/{name}"]
    assert len(read) >= len(recorded[1])
    for message, image in zip(read, recorded[1], strict=False):
        stamp = message.header.stamp.sec + message.header.stamp.nanosec * 1e-9
        assert stamp == pytest.approx(image.stamp, abs=1e-9)
        assert (message.encoding, message.header.frame_id) == (encoding, FRAMES[name.split("/")[0]])
        if encoding == "rgb8":
            np.testing.assert_array_equal(message.data.reshape(240, message.step)[:, : 3 * 424].reshape(240, 424, 3), image.colour)
        else:
            depth = message.data.view("<u2").reshape(240, 424)
            np.testing.assert_array_equal(depth == 0, np.isnan(image.depth))
            np.testing.assert_allclose(depth[depth > 0] / 1000.0, image.depth[depth > 0], rtol=1e-6)


@pytest.mark.parametrize("name", ["color", "depth"])
def test_rosbags_reads_the_camera_infos(recorded, messages, name):
    read = messages[f"/camera/{name}/camera_info"]
    assert len(read) >= len(recorded[1])
    for message, image in zip(read, recorded[1], strict=False):
        info = image.colour_info if name == "color" else image.depth_info
        assert message.header.stamp.sec + message.header.stamp.nanosec * 1e-9 == pytest.approx(image.stamp, abs=1e-9)
        assert (message.header.frame_id, message.width, message.height) == (FRAMES[name], 424, 240)
        assert message.distortion_model == "plumb_bob"
        np.testing.assert_array_equal(message.k, info.K.ravel())
        np.testing.assert_array_equal(message.d, info.D)
        np.testing.assert_array_equal(message.p.reshape(3, 4)[:, :3], info.K)
