import contextlib
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from hardware.protocols import scip, scip_numbers, scip_sweep
from hardware.protocols.errors import ProtocolError
from hardware.protocols.scip import Geometry, Replies, Reply, Request, Stream
from hardware.protocols.scip_sweep import Sweep

RANGES = arrays.arrays(np.int64, st.integers(1, 700), elements=st.integers(0, 4095))
PP = (
    b"PP\n00P\nMODL:URG-04LX-UG01(Simple-URG)(Hokuyo Automatic Co.,Ltd.);N\nDMIN:20;4\nDMAX:5600;_\nARES:1024;\\\nAMIN:44;7\n"
    b"AMAX:725;o\nAFRT:384;6\nSCAN:600;e\n\n"
)
VV = (
    b"VV\n00P\nVEND:Hokuyo Automatic Co.,Ltd.;[\nPROD:SOKUIKI Sensor URG-04LX-UG01(Simple-URG);[\nFIRM:3.4.03(17/Dec./2012);T\n"
    b"PROT:SCIP 2.0;N\nSERI:H1510998;V\n\n"
)


@pytest.fixture(scope="module")
def exchange(shared_data):
    """What a real sensor said, and what it was asked."""
    said, asked = b"", []
    for line in (shared_data / "urg04lx" / "exchange.txt").read_text("latin-1").splitlines():
        found = re.fullmatch(r"[\d.]+ ([HS])> (.*)\\n", line)
        if found is not None:
            text = found[2].replace("\\\\", "\\").encode("latin-1") + b"\n"
            said, asked = (said + text, asked) if found[1] == "S" else (said, [*asked, text])
    return said, asked


def test_every_sum_of_a_real_sensor_is_right(exchange):
    said, asked = exchange
    replies = Replies()
    found = replies.feed(said)
    assert replies.broken == 0
    assert [reply.echo.encode() + b"\n" for reply in found] == asked
    assert b"".join(reply.pack() for reply in found) == said


def test_a_real_scan_is_read(exchange):
    reply = Replies().feed(exchange[0])[-1]
    sweep = scip_sweep.parse_sweep(reply, 3, 682)
    assert len(reply.pack()) == 2134
    assert sweep.ranges_mm[:5].tolist() == [392, 392, 391, 385, 381]
    assert sweep.ranges_mm[340] == 4152
    assert np.count_nonzero(sweep.ranges_mm < 20) == np.isin(sweep.ranges_mm, [0, 6, 7, 10]).sum() > 50
    metres = scip_sweep.to_metres(sweep.ranges_mm, 5600)
    assert np.isinf(metres).sum() == np.count_nonzero(sweep.ranges_mm == 0)
    assert np.nanmin(metres) >= 0.02


def test_the_geometry_of_a_real_sensor_is_read_and_written():
    geometry = scip.parse_geometry(Replies().feed(PP)[0])
    assert geometry == Geometry("URG-04LX-UG01(Simple-URG)(Hokuyo Automatic Co.,Ltd.)", 20, 5600, 1024, 44, 725, 384, 600)
    assert Reply("PP", "00", geometry.lines()).pack() == PP


def test_the_version_of_a_real_sensor_is_read():
    reply = Replies().feed(VV)[0]
    assert scip.parse_fields(reply)["SERI"] == "H1510998"
    assert reply.pack() == VV


@pytest.mark.parametrize("status", ["00P", "01Q", "02R", "03S", "04T", "05U", "10Q", "99b", "0Aa", "0Bb", "0Cc", "0Dd", "0Ee", "0Ff"])
def test_statuses_have_their_sums(status):
    assert scip.checksum(status[:2]) == status[2]


@pytest.mark.parametrize(("value", "text"), [(1234, "CB"), (4095, "oo"), (5432, "1Dh"), (16000000, "m2@0"), (11149560, "ZR3h")])
def test_numbers_have_their_characters(value, text):
    assert scip_numbers.encode_number(value, len(text)) == text
    assert scip_numbers.decode_number(text) == value


@given(st.integers(0, (1 << 24) - 1), RANGES, st.sampled_from([2, 3]))
def test_sweeps_come_back(stamp_ms, ranges_mm, size):
    reply = Reply("MD0044072501000", scip.DATA, scip_sweep.sweep_lines(Sweep(stamp_ms, ranges_mm), size))
    again = scip_sweep.parse_sweep(Replies().feed(reply.pack())[0], size, len(ranges_mm))
    assert again.stamp_ms == stamp_ms
    assert np.array_equal(again.ranges_mm, ranges_mm)


@given(st.integers(0, 2000), st.integers(1, 255))
def test_no_scan_with_a_wrong_character_passes(place, change):
    raw = Reply("GD0044072501", "00", scip_sweep.sweep_lines(Sweep(5, np.arange(682) + 20), 3)).pack()
    place = 20 + place
    broken = raw[:place] + bytes([raw[place] ^ change]) + raw[place + 1 :]
    for reply in Replies().feed(broken):
        with contextlib.suppress(ProtocolError):
            assert np.array_equal(scip_sweep.parse_sweep(reply, 3, 682).ranges_mm, np.arange(682) + 20)


@given(st.binary(max_size=300).filter(lambda noise: b"\n\n" not in noise), st.integers(1, 50))
def test_the_next_reply_is_found_after_garbage(noise, size):
    replies, found = Replies(), []
    stream = noise + b"\n\n" + PP
    for k in range(0, len(stream), size):
        found += replies.feed(stream[k : k + size])
    assert found[-1].pack() == PP


def test_noise_without_an_end_is_not_kept():
    replies = Replies()
    for _ in range(100):
        replies.feed(b"x" * 1000)
    assert replies.feed(b"\n\n" + PP)[-1].echo == "PP"


@given(st.text(max_size=40))
def test_any_line_is_a_request_or_refused(line):
    with contextlib.suppress(ProtocolError):
        scip.parse_stream(scip.parse_request(line).parameters)


def test_requests_come_back():
    for request in (Request("MD", Stream(44, 725).pack()), Request("VV", tag="a 1"), Request("SCIP2.0"), Request("%ST")):
        assert scip.parse_request(request.pack().decode().rstrip("\n")) == request
    assert Request("MD", Stream(44, 725).pack()).pack() == b"MD0044072501000\n"


def test_codes_are_no_ranges():
    metres = scip_sweep.to_metres(np.array([0, 7, 19, 20, 1500, 5601]), 5600)
    np.testing.assert_array_equal(metres, [np.inf, np.nan, np.nan, 0.02, 1.5, np.inf])
    assert scip_sweep.to_millimetres(metres).tolist() == [0, 7, 7, 20, 1500, 0]


@pytest.mark.parametrize(
    ("what", "arguments"),
    [
        (scip_numbers.encode_number, (4096, 2)),
        (scip_numbers.encode_numbers, (np.array([-1]), 3)),
        (scip_numbers.decode_numbers, ("000", 2)),
        (scip_numbers.decode_numbers, ("0~", 2)),
        (scip.parse_reply, (["MD"],)),
        (scip.parse_reply, (["MD", "0P"],)),
        (scip_sweep.parse_sweep, (Reply("GD", "00"), 3, 682)),
        (scip_sweep.parse_sweep, (Reply("GD", "00", ("0000", "000")), 3, 682)),
        (scip.parse_geometry, (Reply("PP", "00", ("MODL:x;", "DMIN:a;")),)),
    ],
)
def test_what_cannot_be_is_an_error_of_one_line(what, arguments):
    with pytest.raises(ProtocolError) as caught:
        what(*arguments)
    assert "\n" not in str(caught.value)
