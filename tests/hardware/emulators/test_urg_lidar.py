import itertools
import time

import hokuyolx
import numpy as np
import pytest

from hardware.emulators.channels import TcpChannel
from hardware.emulators.port import Port
from hardware.emulators.urg_lidar import Turn, UrgLidar
from hardware.protocols import scip, scip_numbers, scip_sweep
from hardware.protocols.scip import Replies

RANGES = np.arange(682) + 1000
SCANS = 30
"""For the independent client; it cannot take two that arrive at once, so time must not run much faster."""


class Mirror:
    """A mirror that turns with a clock."""

    def __init__(self):
        self.now = 0.0
        self.turns = 0

    def turn(self):
        number = int(self.now * 10.0) - 1
        return Turn(number / 10.0, RANGES + number) if number >= 0 else None

    def clock(self):
        return self.now


@pytest.fixture
def mirror():
    return Mirror()


@pytest.fixture
def lidar(mirror):
    return UrgLidar(mirror.turn, mirror.clock, zero_ms=scip_sweep.WRAP_MS - 250)


def ask(lidar, text):
    return Replies().feed(lidar.exchange(text.encode()))


def listen(lidar, mirror, seconds):
    replies = Replies()
    found = []
    for _ in range(round(seconds * 100)):
        mirror.now = round(mirror.now + 0.01, 6)
        found += replies.feed(lidar.exchange(b""))
    assert replies.broken == 0
    return found


@pytest.mark.parametrize(
    ("asked", "answer"),
    [
        ("BM\n", b"BM\n00P\n\n"),
        ("BM\rBM\n", b"BM\n00P\n\nBM\n02R\n\n"),
        ("QT\n", b"QT\n00P\n\n"),
        ("XX\n", b"XX\n0Ee\n\n"),
        ("SCIP2.0\n", b"SCIP2.0\n0Ee\n\n"),
        ("%ST\n", b"%ST\n0Ee\n\n"),
        ("QT;hello\n", b"QT;hello\n00P\n\n"),
        ("\n\r\n", b""),
        ("CR00\n", b"CR00\n03S\n\n"),
        ("MD0044072501000\n", b"MD0044072501000\n00P\n\n"),
        ("MD0043072501000\n", b"MD0043072501000\n04T\n\n"),
        ("MD0725004401000\n", b"MD0725004401000\n05U\n\n"),
        ("MDx044072501000\n", b"MDx044072501000\n01Q\n\n"),
        ("MD00440725010\n", b"MD00440725010\n0Cc\n\n"),
        ("GD0044072501\n", b"GD0044072501\n10Q\n\n"),
        ("TM1\n", b"TM1\n04T\n\n"),
        ("TM0\nTM0\nBM\nTM2\nTM2\n", b"TM0\n00P\n\nTM0\n02R\n\nBM\n0Ee\n\nTM2\n00P\n\nTM2\n03S\n\n"),
    ],
)
def test_it_answers_as_the_sensor_does(lidar, asked, answer):
    assert lidar.exchange(asked.encode()) == answer


def test_a_command_that_comes_in_pieces_is_one(lidar):
    assert lidar.exchange(b"B") == b""
    assert lidar.exchange(b"M\n") == b"BM\n00P\n\n"


def test_its_geometry_is_that_of_the_ug01(lidar):
    assert scip.parse_geometry(ask(lidar, "PP\n")[0])[1:] == (20, 5600, 1024, 44, 725, 384, 600)
    assert len(ask(lidar, "VV\n")[0].lines) == 5
    assert scip.parse_fields(ask(lidar, "II\n")[0])["LASR"] == "OFF"


def test_a_stream_has_every_turn_once_and_its_stamps_wrap(lidar, mirror):
    ask(lidar, "MD0044072501000\n")
    sweeps = [scip_sweep.parse_sweep(reply, 3, 682) for reply in listen(lidar, mirror, 1.05)]
    assert len(sweeps) == 10
    assert all(np.array_equal(sweep.ranges_mm, RANGES + k) for k, sweep in enumerate(sweeps))
    steps = [(b.stamp_ms - a.stamp_ms) % scip_sweep.WRAP_MS for a, b in itertools.pairwise(sweeps)]
    assert all(abs(step - 100) <= 1 for step in steps)
    assert sweeps[0].stamp_ms > sweeps[-1].stamp_ms


def test_a_counted_stream_counts_down_skips_and_switches_off(lidar, mirror):
    ask(lidar, "MD0044072501102\n")
    assert lidar.laser
    assert [reply.echo[-2:] for reply in listen(lidar, mirror, 1.0)] == ["01", "00"]
    assert not lidar.laser


def test_a_single_scan_comes_with_the_next_turn(lidar, mirror):
    mirror.now = 0.55
    lidar.exchange(b"BM\n")
    assert lidar.exchange(b"GS0384039503\n") == b""
    (reply,) = listen(lidar, mirror, 0.2)
    assert reply.echo == "GS0384039503"
    assert scip_numbers.decode_numbers("".join(reply.lines[1:]), 2).tolist() == [RANGES[340 + 3 * k] + 5 for k in range(4)]
    assert lidar.laser


def test_a_group_without_any_range_has_a_code():
    codes = np.full(682, 7, np.int64)
    codes[4] = 900
    lidar = UrgLidar(iter([None, Turn(0.0, codes)]).__next__, lambda: 1.0)
    lidar.exchange(b"MD0044005204000\n")
    (reply,) = Replies().feed(lidar.exchange(b""))
    assert scip_numbers.decode_numbers("".join(reply.lines[1:]), 3).tolist() == [7, 900, 7]


def test_the_time_is_told_only_in_its_mode(lidar, mirror):
    ask(lidar, "TM0\n")
    mirror.now = 1.0
    assert scip_numbers.decode_number(ask(lidar, "TM1\n")[0].lines[0]) == 750


def test_there_are_no_scans_before_the_motor_is_fast(mirror):
    lidar = UrgLidar(mirror.turn, mirror.clock, spin_up=1.0)
    ask(lidar, "MD0044072501000\n")
    assert len(listen(lidar, mirror, 0.9)) == 0
    assert len(listen(lidar, mirror, 0.6)) == 6


@pytest.mark.wall_clock
def test_an_independent_client_reads_every_scan():
    start = time.monotonic()
    mirror = Mirror()

    def clock():
        mirror.now = 2.0 * (time.monotonic() - start)
        return mirror.now

    def turn():
        if clock() < (mirror.turns + 1) / 10.0:
            return None
        mirror.turns += 1
        return Turn((mirror.turns - 1) / 10.0, RANGES)

    with Port(UrgLidar(turn, clock), TcpChannel()) as port:
        host, number = port.address.removeprefix("tcp:").split(":")
        client = hokuyolx.HokuyoLX(addr=(host, int(number)), tsync=False, convert_time=False)
        stamps = []
        try:
            for ranges, stamp, _ in itertools.islice(client.iter_dist(), SCANS):
                stamps.append(stamp)
                assert len(ranges) == 682
        finally:
            client.close()
    assert len(stamps) == SCANS
    assert np.diff(stamps).tolist() == pytest.approx([100.0] * (SCANS - 1), abs=1.0)
