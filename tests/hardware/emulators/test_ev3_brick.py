import struct
import time

import pytest

from hardware.emulators.ev3_brick import Ev3Brick
from hardware.protocols import ev3_direct
from hardware.protocols.ev3_codes import Instruction, Variable, encode
from hardware.protocols.ev3_direct import Messages, Request, command, parse_reply

pytestmark = pytest.mark.wall_clock


def say(name, *arguments):
    return Instruction(name, arguments)


class Client:
    def __init__(self, brick):
        self.brick = brick
        self.messages = Messages()

    def send(self, raw):
        return [parse_reply(message) for message in self.messages.feed(self.brick.exchange(raw))]

    def ask(self, *instructions, size=0, seconds=3.0):
        replies, end = self.send(command(1, *instructions, global_bytes=size)), time.monotonic() + seconds
        while not replies and time.monotonic() < end:
            time.sleep(0.001)
            self.brick.tick()
            replies = self.send(b"")
        return replies[0]

    def pass_time(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            time.sleep(0.001)
            self.brick.tick()
        return self.send(b"")


@pytest.fixture
def client(rollers):
    return Client(Ev3Brick(rollers, wifi=False))


def test_it_must_be_unlocked_over_wifi(rollers):
    brick = Ev3Brick(rollers)
    ping = bytes.fromhex("06002A000000 0001")
    assert brick.exchange(ping) == b""
    assert brick.exchange(ev3_direct.unlock("x")) == ev3_direct.UNLOCKED
    assert brick.exchange(ping) == bytes.fromhex("03002A0002")
    brick.attach()
    assert brick.exchange(ping) == b""


@pytest.mark.parametrize(
    ("asked", "answer"),
    [
        ("06 00 2A 00 00 00 00 01", "03 00 2A 00 02"),
        (
            "1D 00 2B 00 00 08 00 99 05 00 10 60 61 99 05 00 11 62 63 99 05 00 12 64 65 99 05 00 13 66 67",
            "0B 00 2B 00 02 07 00 7E 00 7E 00 07 00",
        ),
        ("09 00 2E 00 00 01 00 A9 00 02 60", "04 00 2E 00 02 00"),
        ("05 00 2A 00 00 00 00", "03 00 2A 00 04"),
        ("07 00 2A 00 00 02 00 FF FF", "05 00 2A 00 04 00 00"),
        ("08 00 2A 00 80 00 00 82 1B 05", ""),
    ],
)
def test_it_answers_as_a_brick_does(client, asked, answer):
    assert client.brick.exchange(bytes.fromhex(asked)).hex(" ") == bytes.fromhex(answer).hex(" ")


def test_speed_takes_effect_with_start_and_goes_on_without_a_client(client, rollers):
    client.ask(say("OUTPUT_SPEED", 0, 9, 50))
    assert rollers.percents == [0, 0, 0, 0]
    client.ask(say("OUTPUT_START", 0, 9))
    assert rollers.percents == [50, 0, 0, 50]
    client.brick.attach()
    client.pass_time(0.05)
    assert rollers.percents == [50, 0, 0, 50]


def test_a_timed_move_ends_by_itself_and_can_be_said_again(client, rollers):
    timed = say("OUTPUT_TIME_SPEED", 0, 9, 50, 0, 100, 0, 1)
    for _ in range(5):
        client.ask(timed)
        client.pass_time(0.05)
        assert rollers.percents[0] == 50
    client.pass_time(0.1)
    assert rollers.percents == [0, 0, 0, 0]


def test_counts_go_on_and_output_read_is_no_odometer(client, rollers):
    client.ask(say("OUTPUT_SPEED", 0, 1, 100), say("OUTPUT_START", 0, 1))
    client.pass_time(0.1)
    reply = client.ask(say("OUTPUT_GET_COUNT", 0, 0, Variable(0)), say("OUTPUT_READ", 0, 0, Variable(4), Variable(8)), size=12)
    count, speed, tacho = struct.unpack("<ib3xi", reply.values)
    assert (count > 50, speed, tacho) == (True, 100, 0)
    client.ask(say("OUTPUT_CLR_COUNT", 0, 1), say("OUTPUT_STOP", 0, 1, 1))
    assert struct.unpack("<i", client.ask(say("OUTPUT_GET_COUNT", 0, 0, Variable(0)), size=4).values)[0] <= 5


def test_ready_answers_at_the_end_of_the_move(client, rollers):
    began = time.monotonic()
    client.ask(say("OUTPUT_STEP_SPEED", 0, 1, 100, 30, 60, 30, 1), say("OUTPUT_READY", 0, 1))
    assert 0.1 < time.monotonic() - began < 2.0
    assert rollers.percents[0] == 0
    assert rollers.angle_deg(0) == pytest.approx(120.0, abs=6.0)


def test_what_comes_while_a_command_runs_is_dropped_or_refused(client):
    wait = say("OUTPUT_TIME_SPEED", 0, 1, 20, 0, 80, 0, 1), say("OUTPUT_READY", 0, 1)
    assert client.send(command(1, *wait)) == []
    assert client.send(command(2, say("NOP"))) == []
    assert [reply.counter for reply in client.pass_time(0.15)] == [1]
    assert client.send(command(3, *wait, reply=False)) == []
    (refused,) = client.send(command(4, say("NOP")))
    assert (refused.counter, refused.ok) == (4, False)


def test_a_change_of_mode_takes_its_time(client, rollers):
    rollers.rate_deg = 33.0
    read = say("INPUT_READSI", 0, 3, 32, 1, Variable(0))
    assert client.ask(read, size=4).values == struct.pack("<f", float("nan"))
    began = time.monotonic()
    reply = client.ask(say("INPUT_READY_SI", 0, 3, 32, 1, 1, Variable(0)), size=4)
    assert time.monotonic() - began > 0.3
    assert struct.unpack("<f", reply.values)[0] == 33.0
    assert struct.unpack("<f", client.ask(read, size=4).values)[0] == 33.0


def test_programs_calculate_compare_and_jump(client):
    low = Variable(0, local=True)
    body = say("ADD32", Variable(0), low, Variable(0)), say("SUB32", low, 1, low)
    back = len(encode(*body, say("JR_GT32", low, 0, -12)))
    loop = (
        say("MOVE32_32", 5, low),
        *body,
        say("JR_GT32", low, 0, -back),
        say("MOVE32_F", Variable(0), Variable(4)),
        say("DIVF", Variable(4), Variable(4), Variable(8)),
        say("CP_EQ32", Variable(0), 15, Variable(12)),
        say("OR8", Variable(12), 2, Variable(13)),
    )
    (reply,) = client.send(Request(1, encode(*loop), True, 14, 4).pack())
    assert reply.ok
    assert struct.unpack("<iff2b", reply.values) == (15, 15.0, 1.0, 1, 3)


def test_a_program_without_an_end_leaves_the_others_alive(client):
    client.send(command(1, say("JR", -2)))
    began = time.monotonic()
    client.brick.tick()
    assert time.monotonic() - began < 1.0


def test_an_answer_takes_the_time_of_the_link(rollers):
    client = Client(Ev3Brick(rollers, wifi=False, delay=lambda: 0.03))
    began = time.monotonic()
    assert client.ask(say("NOP")).ok
    assert 0.03 <= time.monotonic() - began < 0.3


def test_synchronised_motors_keep_their_ratio(client, rollers):
    client.ask(say("OUTPUT_STEP_SYNC", 0, 9, 60, 50, 200, 1), say("OUTPUT_READY", 0, 9))
    assert rollers.angle_deg(0) == pytest.approx(200.0, abs=8.0)
    assert rollers.angle_deg(3) == pytest.approx(100.0, abs=8.0)
    client.ask(say("OUTPUT_STEP_SYNC", 0, 9, 60, -200, 90, 1), say("OUTPUT_READY", 0, 9))
    assert rollers.angle_deg(0) == pytest.approx(110.0, abs=14.0)
