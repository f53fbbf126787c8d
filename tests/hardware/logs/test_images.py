from dataclasses import replace

import numpy as np
import pytest

from hardware.camera_spec import d435
from hardware.hal import Command
from hardware.logs.ros_reading import ReadingDecoder
from hardware.logs.ros_writing import written
from hardware.recorder import Recorder
from hardware.replay import Replay
from hardware.spec import RobotSpec
from hardware.urdf import urdf
from slam.messages import RgbdImage, Twist

SPEC = RobotSpec(camera=d435((424, 240), (424, 240)))


def picture(stamp=1.25, seed=0, spec=SPEC):
    rng = np.random.default_rng(seed)
    depth_mm = rng.integers(0, 65536, (240, 424))
    depth = np.where(depth_mm == 0, np.nan, depth_mm.astype(np.float32) / np.float32(1000.0)).astype(np.float32)
    return RgbdImage(stamp, rng.integers(0, 256, (240, 424, 3), dtype=np.uint8), depth, *spec.camera_infos())


def read_back(image, spec=SPEC):
    decoder = ReadingDecoder(spec)
    found = [decoder.read(topic, message) for topic, message in written(image)]
    assert found[:-1] == [None] * (len(found) - 1)
    return found[-1]


def same(a, b):
    infos = zip((a.colour_info, a.depth_info), (b.colour_info, b.depth_info), strict=True)
    return (a.stamp, a.colour.tobytes(), a.depth.tobytes()) == (b.stamp, b.colour.tobytes(), b.depth.tobytes()) and all(
        np.array_equal(p.K, q.K) and np.array_equal(p.D, q.D) and (p.row_time, p.T_base_camera) == (q.row_time, q.T_base_camera)
        for p, q in infos
    )


def test_an_image_comes_back_bit_for_bit():
    image = picture()
    channel, back = read_back(image)
    assert channel == "images"
    assert same(image, back)


def test_a_depth_image_without_its_colour_image_is_passed_over():
    messages = dict(written(picture()))
    assert ReadingDecoder(SPEC).read("/camera/depth/image_rect_raw", messages["/camera/depth/image_rect_raw"]) is None


def test_an_image_of_another_size_is_refused():
    with pytest.raises(ValueError, match="an image of 424 x 240 rgb8; the specification says 848 x 480 rgb8"):
        read_back(picture(), RobotSpec())


def test_an_image_of_a_robot_without_a_camera_is_refused():
    with pytest.raises(ValueError, match="has no camera"):
        read_back(picture(), replace(SPEC, camera=None))


def test_a_recording_gives_its_images_back(make_body, tmp_path):
    body = make_body(spec=SPEC)
    images = [picture((1 + 2 * k) / 10, k) for k in range(4)]
    with body, Recorder(body, tmp_path, urdf(SPEC)) as recorder:
        ticks = 0
        while body.clock.sleep_until(body.clock.now() + 0.1):
            if ticks % 2 == 0 and ticks // 2 < len(images):
                body.queues["images"].put(images[ticks // 2])
            body.queues["commands"].put(Command(body.clock.now(), Twist()))
            recorder.flush()
            ticks += 1
    found = []
    with Replay(tmp_path).build() as replay:
        while replay.clock.sleep_until(replay.clock.now() + 0.1):
            found += replay.read().images
        found += replay.read().images
    assert len(found) == len(images)
    assert all(same(a, b) for a, b in zip(images, found, strict=True))
