import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware.camera_spec import d435
from hardware.emulators.d435 import hello
from hardware.protocols import camera_frames
from hardware.protocols.camera_frames import Kind, Messages, Pair
from hardware.protocols.errors import ProtocolError


def a_pair(number: int = 3) -> Pair:
    rng = np.random.default_rng(number)
    return Pair(number, 10, 20, rng.integers(0, 256, (4, 6, 3), np.uint8), rng.integers(0, 1 << 16, (3, 5), np.uint16))


@given(cut=st.integers(1, 200), count=st.integers(1, 4))
def test_pairs_come_back_from_a_stream_in_pieces(cut, count):
    stream = b"".join(camera_frames.pack_pair(a_pair(number)) for number in range(count))
    messages, found = Messages(), []
    for place in range(0, len(stream), cut):
        found += messages.feed(stream[place : place + cut])
    assert [kind for kind, _ in found] == [Kind.PAIR] * count
    for number, (_, body) in enumerate(found):
        pair, sent = camera_frames.parse_pair(body), a_pair(number)
        assert pair[:3] == sent[:3]
        assert np.array_equal(pair.colour, sent.colour)
        assert np.array_equal(pair.depth, sent.depth)


def test_a_camera_that_says_what_it_is_is_understood():
    said = hello(d435((640, 480), (480, 270), 30))
    ((kind, body),) = Messages().feed(camera_frames.pack_hello(said))
    assert kind == Kind.HELLO
    assert camera_frames.parse_hello(body) == said
    assert (said.rate, said.colour.width, said.depth.height, said.translation[0]) == (30, 640, 270, 0.015)


@given(number=st.integers(0, 2**32 - 1), time_us=st.integers(-(2**63), 2**63 - 1))
def test_times_come_back(number, time_us):
    ((_, body),) = Messages().feed(camera_frames.pack_time(number, time_us))
    assert camera_frames.parse_time(body) == (number, time_us)


@given(place=st.integers(0, 136), value=st.integers(0, 255))
def test_a_changed_byte_is_never_passed_on(place, value):
    good = camera_frames.pack_pair(a_pair())
    bad = good[:place] + bytes([value]) + good[place + 1 :]
    try:
        found = Messages().feed(bad)
    except ProtocolError:
        return
    assert bad == good or not found or found[0].kind != Kind.PAIR


@pytest.mark.parametrize(
    ("parse", "body"),
    [
        (camera_frames.parse_pair, b"short"),
        (camera_frames.parse_pair, b"\1" * 40),
        (camera_frames.parse_time, b"short"),
        (camera_frames.parse_hello, b"{}"),
        (camera_frames.parse_hello, b"\xff"),
        (camera_frames.parse_hello, camera_frames.pack_hello(hello(d435()))[13:].replace(b'"rate":15', b'"rate":0')),
    ],
)
def test_what_is_no_message_is_an_error(parse, body):
    with pytest.raises(ProtocolError):
        parse(body)
