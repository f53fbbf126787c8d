import contextlib
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware.protocols import ev3_direct
from hardware.protocols.errors import ProtocolError
from hardware.protocols.ev3_codes import Instruction, Variable, decode
from hardware.protocols.ev3_direct import Beacon, Messages, Reply, Request, command, parse_beacon, parse_reply, parse_request


def say(name, *arguments):
    return Instruction(name, arguments)


def V(offset):
    return Variable(offset)


def types(first):
    return [say("INPUT_GET_TYPEMODE", 0, first + k, V(2 * k), V(2 * k + 1)) for k in range(4)]


def batteries():
    return [say("UI_READ_GET_VBATT", V(0)), say("UI_READ_GET_IBATT", V(4)), say("UI_READ_GET_LBATT", V(8))]


def one_poll():
    return [
        say("OUTPUT_GET_COUNT", 0, 0, V(0)),
        say("OUTPUT_GET_COUNT", 0, 3, V(4)),
        say("INPUT_READY_SI", 0, 3, 32, 3, 2, V(8), V(12)),
        say("UI_READ_GET_VBATT", V(16)),
        say("OUTPUT_TEST", 0, 9, V(20)),
    ]


FRAMES = {
    "ping": (0x2A, [say("NOP")], 0, True, "06 00 2A 00 00 00 00 01"),
    "battery": (0x2A, batteries(), 9, True, "0E 00 2A 00 00 09 00 81 01 60 81 02 64 81 12 68"),
    "inputs": (0x2A, types(0), 8, True, "1D 00 2A 00 00 08 00 99 05 00 00 60 61 99 05 00 01 62 63 99 05 00 02 64 65 99 05 00 03 66 67"),
    "outputs": (0x2B, types(16), 8, True, "1D 00 2B 00 00 08 00 99 05 00 10 60 61 99 05 00 11 62 63 99 05 00 12 64 65 99 05 00 13 66 67"),
    "touch": (0x2A, [say("INPUT_READY_SI", 0, 0, 16, 0, 1, V(0))], 4, True, "0D 00 2A 00 00 04 00 99 1D 00 00 10 00 01 60"),
    "move": (
        0x2D, [say("OUTPUT_STEP_SPEED", 0, 2, 5, 15, 60, 15, 1), say("OUTPUT_READY", 0, 2)], 0, True,
        "11 00 2D 00 00 00 00 AE 00 02 05 0F 81 3C 0F 01 AA 00 02",
    ),
    "busy": (0x2E, [say("OUTPUT_TEST", 0, 2, V(0))], 1, True, "09 00 2E 00 00 01 00 A9 00 02 60"),
    "led": (0x2A, [say("UI_WRITE_LED", 5)], 0, False, "08 00 2A 00 80 00 00 82 1B 05"),
    "speed": (0x108, [say("OUTPUT_SPEED", 0, 9, 50), say("OUTPUT_START", 0, 9)], 0, True, "0D 00 08 01 00 00 00 A5 00 09 81 32 A6 00 09"),
    "two speeds": (
        0x2B, [say("OUTPUT_SPEED", 0, 1, -25), say("OUTPUT_SPEED", 0, 8, 35), say("OUTPUT_START", 0, 9)], 0, True,
        "11 00 2B 00 00 00 00 A5 00 01 27 A5 00 08 81 23 A6 00 09",
    ),
    "timed": (0x2C, [say("OUTPUT_TIME_SPEED", 0, 9, 30, 0, 300, 0, 1)], 0, True, "0F 00 2C 00 00 00 00 AF 00 09 1E 00 82 2C 01 00 01"),
    "counts": (
        0x109, [say("OUTPUT_GET_COUNT", 0, 0, V(0)), say("OUTPUT_GET_COUNT", 0, 3, V(4))], 8, True,
        "0D 00 09 01 00 08 00 B3 00 00 60 B3 00 03 64",
    ),
    "stop": (0x10B, [say("OUTPUT_STOP", 0, 9, 1)], 0, True, "09 00 0B 01 00 00 00 A3 00 09 01"),
    "clear": (0x10C, [say("OUTPUT_CLR_COUNT", 0, 9)], 0, True, "08 00 0C 01 00 00 00 B2 00 09"),
    "sync": (0x10D, [say("OUTPUT_STEP_SYNC", 0, 9, 40, -100, 360, 1)], 0, True, "10 00 0D 01 00 00 00 B0 00 09 81 28 81 9C 82 68 01 01"),
    "poll": (
        0x2A, one_poll(), 21, True,
        "1E 00 2A 00 00 15 00 B3 00 00 60 B3 00 03 64 99 1D 00 03 81 20 03 02 68 6C 81 01 70 A9 00 09 74",
    ),
}  # fmt: skip
"""Frames that were captured from real bricks or worked out by hand from the firmware."""


@pytest.mark.parametrize("name", FRAMES)
def test_a_known_frame_is_made_byte_by_byte(name):
    counter, instructions, sizes, reply, expected = FRAMES[name]
    assert command(counter, *instructions, reply=reply, global_bytes=sizes) == bytes.fromhex(expected)


@pytest.mark.parametrize("name", FRAMES)
def test_a_known_frame_is_understood(name):
    counter, instructions, sizes, reply, raw = FRAMES[name]
    request = parse_request(bytes.fromhex(raw))
    assert (request.counter, request.global_bytes, request.local_bytes, request.wants_reply) == (counter, sizes, 0, reply)
    assert decode(request.codes) == instructions


def test_the_battery_of_a_real_brick_is_read():
    reply = parse_reply(bytes.fromhex("0C 00 2A 00 02 7C 03 F1 40 40 07 3B 3E 64"))
    assert struct.unpack("<ffb", reply.values) == pytest.approx((7.5317, 0.1826, 100), abs=1e-4)


@pytest.mark.parametrize(
    ("raw", "values"),
    [
        ("0B 00 2A 00 02 10 00 1D 00 21 00 7E 00", (16, 0, 29, 0, 33, 0, 126, 0)),
        ("0B 00 2B 00 02 07 00 7E 00 08 00 07 00", (7, 0, 126, 0, 8, 0, 7, 0)),
    ],
)
def test_what_is_plugged_into_a_real_brick_is_read(raw, values):
    assert struct.unpack("<8b", parse_reply(bytes.fromhex(raw)).values) == values


def test_a_report_of_usb_is_read_without_what_fills_it():
    assert parse_reply(bytes.fromhex("07 00 2A 00 02 00 00 80 3F").ljust(1024, b"\xaa")) == Reply(0x2A, bytes.fromhex("0000803F"))


def test_an_error_keeps_its_values():
    reply = Reply(7, b"\x01\x02", ok=False)
    assert reply.pack() == bytes.fromhex("05 00 07 00 04 01 02")
    assert parse_reply(reply.pack()) == reply


REQUESTS = st.builds(
    Request, st.integers(0, 65535), st.binary(min_size=1, max_size=60), st.booleans(), st.integers(0, 1021), st.integers(0, 63)
)


@given(REQUESTS)
def test_requests_come_back(request):
    assert parse_request(request.pack()) == request


@given(st.builds(Reply, st.integers(0, 65535), st.binary(max_size=200), st.booleans()))
def test_replies_come_back(reply):
    assert parse_reply(reply.pack()) == reply


@given(st.lists(REQUESTS, max_size=5), st.integers(1, 30))
def test_a_stream_is_cut_into_its_messages_wherever_it_is_split(requests, size):
    stream, messages, found = b"".join(request.pack() for request in requests), Messages(), []
    for k in range(0, len(stream), size):
        found += messages.feed(stream[k : k + size])
    assert [parse_request(message) for message in found] == requests


def test_a_length_that_no_message_has_ends_the_stream():
    with pytest.raises(ProtocolError, match="5 to 1024 bytes"):
        Messages().feed(b"\xff\xff\x00")


@given(st.binary(max_size=80))
def test_any_bytes_are_a_reply_or_refused(raw):
    for parse in (parse_reply, parse_request, parse_beacon):
        with contextlib.suppress(ProtocolError):
            parse(raw)


def test_a_message_that_is_too_long_is_refused():
    with pytest.raises(ProtocolError, match="1024 bytes at most"):
        Request(0, b"\x01" * 1020).pack()
    with pytest.raises(ProtocolError, match="within 65535"):
        Request(0, b"\x01", global_bytes=1022).pack()


def test_a_beacon_is_what_the_firmware_sends():
    beacon = Beacon("001653422b99")
    assert beacon.pack() == b"Serial-Number: 001653422b99\r\nPort: 5555\r\nName: EV3\r\nProtocol: EV3\r\n"
    assert parse_beacon(beacon.pack()) == beacon


def test_the_firmware_finds_the_words_that_unlock_it():
    assert ev3_direct.is_unlock(ev3_direct.unlock("001653422b99"))
    assert ev3_direct.is_unlock(ev3_direct.unlock())
    assert not ev3_direct.is_unlock(b"GET /index.html")
