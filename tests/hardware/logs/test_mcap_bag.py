"""Our own recordings: whole, cut, corrupt, and as other programs see them."""

import struct
from pathlib import Path

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from hardware.errors import RecordingError
from hardware.logs.mcap_writer import BagWriter
from hardware.logs.registry import open_log
from hardware.logs.ros_writing import text, written
from hardware.logs.spec_file import write_spec
from hardware.recorder import Recorder
from hardware.spec import RobotSpec
from slam.messages import WheelOdometry
from slam.se2 import SE2

SECOND = 10**9


@pytest.fixture
def bag(make_body, tmp_path) -> Path:
    """The folder of a finished recording of 3 s."""
    with make_body() as body, Recorder(body, tmp_path / "bag", "<robot/>") as recorder:
        while body.clock.sleep_until(np.inf):
            recorder.add_truth(body.clock.now(), 1.0, 2.0, 3.0)
            recorder.flush()
    return tmp_path / "bag"


def readings(path):
    return [(event.arrival, event.channel, event.message.stamp) for event in open_log(path).events()]


def test_the_folder_the_file_and_a_run_folder_are_the_same_recording(bag):
    (bag / "config.toml").write_text("")
    assert readings(bag) == readings(bag / "recording.mcap")


def test_truth_and_description_come_back(bag):
    log = open_log(bag)
    assert log.description() == "<robot/>"
    assert len(log.truth()) == 150
    assert log.truth().poses[0].tolist() == [1.0, 2.0, 3.0]


def test_rosbags_reads_every_message_of_the_bag(bag):
    store, count = get_typestore(Stores.ROS2_HUMBLE), 0
    with Reader(bag) as reader:
        topics = {connection.topic: connection.msgcount for connection in reader.connections}
        for connection, time, content in reader.messages(connections=reader.connections):
            message = store.deserialize_cdr(content, connection.msgtype)
            assert not hasattr(message, "header") or message.header.stamp.sec <= time // SECOND
            count += 1
        assert count == reader.message_count == sum(topics.values())
    assert topics["/scan"] == 30
    assert topics["/odom"] == topics["/tf"] == topics["/joint_states"] == topics["/imu"] == topics["/cmd_vel"] == 150


def test_rosbags_finds_the_message_definitions_in_the_bag(bag):
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Reader(bag) as reader:
        for connection in reader.connections:
            assert connection.msgdef.data
            assert store.generate_msgdef(connection.msgtype)[0]


def test_mcap_decodes_the_bag_with_the_definitions_in_it(bag):
    with (bag / "recording.mcap").open("rb") as file:
        decoded = list(make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()]).iter_decoded_messages())
    assert {channel.topic for _, channel, _, _ in decoded} >= {"/scan", "/odom", "/tf_static", "/robot_description", "/ground_truth"}


def test_the_description_and_mounts_are_latched(bag):
    metadata = yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    latched = {
        topic["topic_metadata"]["name"]
        for topic in metadata["topics_with_message_count"]
        if "durability: 1" in topic["topic_metadata"]["offered_qos_profiles"]
    }
    assert latched == {"/robot_spec", "/robot_description", "/tf_static"}


def test_a_bag_that_is_cut_anywhere_gives_its_complete_seconds_or_says_that_there_are_none(bag, tmp_path, caplog):
    whole, content = readings(bag), (bag / "recording.mcap").read_bytes()
    cut_file, most = tmp_path / "cut.mcap", 0
    for cut in range(1, len(content), max(1, len(content) // 40)):
        cut_file.write_bytes(content[:cut])
        try:
            part = readings(cut_file)
        except RecordingError:
            assert most == 0
            continue
        assert part == whole[: len(part)]
        assert len(part) >= most
        most = len(part)
    assert most == len(whole)
    assert "was not finished" in caplog.text


def chunks(content):
    at = 8
    while at < len(content) - 8:
        opcode, length = struct.unpack_from("<BQ", content, at)
        if opcode == 6:
            yield at, length
        at += 9 + length


def test_a_corrupt_chunk_is_named_with_what_is_readable_before_it(bag):
    file = bag / "recording.mcap"
    content = bytearray(file.read_bytes())
    at, length = list(chunks(content))[1]
    content[at + 9 + length // 2] ^= 0xFF
    file.write_bytes(content)
    with pytest.raises(RecordingError, match=rf"corrupt at byte {at} .* up to 0\.920 s, is whole: cut the file there"):
        open_log(bag)
    file.write_bytes(content[:at])
    assert readings(bag)[-1][0] == 0.92


def test_a_flipped_bit_never_gives_other_readings(bag):
    whole, file = readings(bag), bag / "recording.mcap"
    content, rng = file.read_bytes(), np.random.default_rng(0)
    for at in rng.integers(0, len(content), 40):
        broken = bytearray(content)
        broken[at] ^= 1 << int(rng.integers(8))
        file.write_bytes(broken)
        try:
            part = readings(bag)
        except RecordingError:
            continue
        assert part == whole[: len(part)]


def write_bag(folder, messages, spec=True):
    writer = BagWriter(folder)
    if spec:
        writer.write(*at_time(0, text("/robot_spec", write_spec(RobotSpec()))))
    for message in messages:
        writer.write(*message)
    writer.finish()
    return folder


def at_time(time_ns, message):
    return message[0], time_ns, message[1]


def odometry(stamp, x=0.0):
    return [at_time(round(stamp * SECOND), message) for message in written(WheelOdometry(stamp, SE2(x, 0.0, 0.0)))]


def test_a_bag_without_scans_says_what_it_has(tmp_path):
    with pytest.raises(RecordingError, match=r"no scans \(/scan\); it has /odom \(1\), /robot_spec \(1\), /tf \(1\)"):
        open_log(write_bag(tmp_path / "bag", odometry(1.0)))


def scan_of(bag):
    with Reader(bag) as reader:
        connections = [connection for connection in reader.connections if connection.topic == "/scan"]
        return next(("/scan", 0, content) for _, _, content in reader.messages(connections=connections))


def test_a_pose_that_is_not_finite_is_named(bag, tmp_path):
    messages = [scan_of(bag), *odometry(0.1), *odometry(0.2, x=np.nan)]
    with pytest.raises(RecordingError, match=r"message 4, on /odom: the pose \[nan, .*\] is not finite"):
        open_log(write_bag(tmp_path / "nan", messages))


def test_stamps_far_back_are_refused(bag, tmp_path):
    messages = [scan_of(bag), *odometry(9.0), *odometry(5.0)]
    with pytest.raises(RecordingError, match=r"on /odom: stamp 5\.0 of odometry runs back by 4\.000 s"):
        open_log(write_bag(tmp_path / "back", messages))


def test_stamps_a_little_back_are_clamped_with_one_warning(bag, tmp_path, caplog):
    log = open_log(write_bag(tmp_path / "back", [scan_of(bag), *odometry(9.0), *odometry(8.0)]))
    assert [event.message.stamp for event in log.events() if event.channel == "odometry"] == [9.0, 9.0]
    assert [record.getMessage().split(": ")[1] for record in caplog.records] == [
        "1 stamps ran back, by up to 1.000 s; clamped to the ones before"
    ]


def test_a_bag_of_an_unknown_robot_asks_for_a_specification(bag, tmp_path):
    unknown = write_bag(tmp_path / "unknown", [scan_of(bag)], spec=False)
    with pytest.raises(RecordingError, match=r"no topic /robot_spec among /scan \(1\); name a robot specification"):
        open_log(unknown)
    assert open_log(unknown, RobotSpec()).spec == RobotSpec()


def test_a_topic_of_another_type_is_refused(tmp_path):
    file = tmp_path / "x.mcap"
    with file.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "bricktwin")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        writer.add_message(writer.register_channel("/scan", "cdr", schema), 0, text("/robot_spec", "hello")[1], 0)
        writer.finish()
    with pytest.raises(RecordingError, match="topic /scan is a std_msgs/msg/String, must be a sensor_msgs/msg/LaserScan"):
        open_log(file)


@pytest.mark.parametrize(
    ("content", "message"),
    [(b"", "the file is empty"), (b"\x89MCAP0\r\n", "no complete chunk"), (b"nonsense" * 9, "it is no MCAP file")],
)
def test_a_file_that_is_none_says_so(tmp_path, content, message):
    file = tmp_path / "x.mcap"
    file.write_bytes(content)
    with pytest.raises(RecordingError, match=message):
        open_log(file)


def test_an_empty_folder_says_what_was_looked_for(tmp_path):
    with pytest.raises(RecordingError, match=r"no recording\.mcap in this folder"):
        open_log(tmp_path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(RecordingError, match=r"nowhere: cannot be read: No such file"):
        open_log(tmp_path / "nowhere")


def test_an_unknown_format_lists_the_known_ones(tmp_path):
    (tmp_path / "x.txt").write_text("hello")
    with pytest.raises(RecordingError, match="of no known format; known: carmen, coreslam, rosbag, mcap"):
        open_log(tmp_path / "x.txt")
