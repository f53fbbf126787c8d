"""CDR against the independent coder of mcap_ros2."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory

from hardware.logs.cdr import decode, encode
from hardware.logs.ros_types import TOPICS, definition

FLOATS = st.floats(allow_nan=False)


@given(st.text(st.characters(codec="utf-8", exclude_characters="\0")), st.lists(FLOATS), FLOATS, st.lists(st.text("abc"), max_size=3))
def test_what_is_encoded_decodes_to_the_same(text, numbers, number, names):
    found = decode("s d* d s*", encode("s d* d s*", text, numbers, number, names))
    assert (found[0], found[1].tolist(), found[2], list(found[3])) == (text, numbers, number, names)


def independent(topic: str, message: bytes):
    kind = TOPICS[topic]
    schema = Schema(id=1, name=kind.type, encoding="ros2msg", data=definition(kind.type).encode())
    return DecoderFactory().decoder_for("cdr", schema)(message)


def test_an_independent_decoder_reads_a_joint_state():
    message = independent("/joint_states", encode(TOPICS["/joint_states"].layout, 5, 6, "ab", ["left", "r"], [1.5, -2.5], [], []))
    assert (message.header.stamp.sec, message.header.stamp.nanosec, message.header.frame_id) == (5, 6, "ab")
    assert (message.name, list(message.position), list(message.effort)) == (["left", "r"], [1.5, -2.5], [])


def test_an_independent_decoder_reads_a_scan():
    message = independent("/scan", encode(TOPICS["/scan"].layout, -1, 6, "laser", np.arange(7), [1.25, np.inf], []))
    assert (message.header.stamp.sec, message.range_max, list(message.ranges)) == (-1, 6.0, [1.25, np.inf])


def test_an_independent_decoder_reads_an_odometry():
    message = independent("/odom", encode(TOPICS["/odom"].layout, 1, 2, "odom", "base", np.arange(85.0)))
    assert (message.pose.pose.orientation.w, message.twist.twist.angular.z, message.twist.covariance[0]) == (6.0, 48.0, 49.0)


def test_an_independent_decoder_reads_an_imu():
    assert independent("/imu", encode(TOPICS["/imu"].layout, 1, 2, "base", np.arange(37.0))).angular_velocity.z == 15.0


def test_an_independent_decoder_reads_transforms():
    message = independent("/tf", encode(TOPICS["/tf"].layout, 1, 3, 4, "odom", "base", np.arange(7.0)))
    assert (message.transforms[0].child_frame_id, message.transforms[0].transform.rotation.w) == ("base", 6.0)


@pytest.mark.parametrize("cut", range(4, 40, 3))
def test_a_message_that_is_cut_is_refused(cut):
    message = encode("i s 3d", 1, "abc", (1.0, 2.0, 3.0))
    with pytest.raises(ValueError, match=r"(in|of) a message of"):
        decode("i s 3d", message[:cut])


def test_big_endian_is_refused_by_name():
    with pytest.raises(ValueError, match="little-endian"):
        decode("i", b"\0\0\0\0\0\0\0\1")


def test_a_wrong_number_of_values_is_refused():
    with pytest.raises(ValueError, match="2 numbers for the field '3d'"):
        encode("3d", (1.0, 2.0))
