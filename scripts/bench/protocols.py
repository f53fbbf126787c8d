"""Decoders of the devices' bytes: random and mutated frames, and how fast good ones are read."""

from __future__ import annotations

import random
import time
from collections.abc import Callable

import numpy as np

from hardware.protocols import camera_frames, ev3_codes, ev3_direct, scip, scip_sweep
from hardware.protocols.camera_frames import Pair
from hardware.protocols.errors import ProtocolError
from hardware.protocols.ev3_codes import Instruction, Variable
from hardware.protocols.scip import Replies, Reply
from hardware.protocols.scip_sweep import Sweep
from scripts.bench.row import Row

FRAMES = 1_000_000
"""Into each decoder."""


def run(smoke: bool) -> list[Row]:
    """Rows of each decoder: broken frames that made it fail with anything but its own error or say what they do not, and its speed.

    A frame whose sums are right by chance is rightly read.
    """
    frames = 2000 if smoke else FRAMES
    counts = [Instruction("OUTPUT_GET_COUNT", (0, k, Variable(4 * k))) for k in range(4)]
    request = ev3_direct.command(7, *counts, global_bytes=16)
    reply = ev3_direct.Reply(7, bytes(range(16))).pack()
    scan = Reply("MD0044072501000", scip.DATA, scip_sweep.sweep_lines(Sweep(5, np.arange(682) + 20), 3)).pack()
    pair = camera_frames.pack_pair(Pair(3, 1, 2, np.zeros((8, 8, 3), np.uint8), np.ones((8, 8), np.uint16)))
    decoders: dict[str, tuple[bytes, Callable[[bytes], bool]]] = {
        "EV3 request": (request, _request_is_right),
        "EV3 reply": (reply, lambda raw: ev3_direct.parse_reply(raw).pack() in raw),
        "EV3 stream": (reply, lambda raw: all(message in raw for message in ev3_direct.Messages().feed(raw))),
        "SCIP scan": (scan, _scans_are_right),
        "camera pair": (pair, _pairs_are_right),
    }
    return [row for name, (good, decode) in decoders.items() for row in _rows(name, good, decode, frames)]


def _request_is_right(raw: bytes) -> bool:
    read = ev3_codes.decode(ev3_direct.parse_request(raw).codes)
    return ev3_codes.decode(ev3_codes.encode(*read)) == read


def _scans_are_right(raw: bytes) -> bool:
    return all(_is_said(reply, scip_sweep.parse_sweep(reply, 3, 682), raw) for reply in Replies().feed(raw))


def _is_said(reply: Reply, sweep: Sweep, raw: bytes) -> bool:
    """Whether the bytes say this scan, block by block."""
    stamp, *blocks = scip_sweep.sweep_lines(sweep, 3)
    same = (stamp, "".join(blocks)) == (reply.lines[0], "".join(reply.lines[1:]))
    return same and all(line.encode("latin-1") in raw for line in reply.lines)


def _pairs_are_right(raw: bytes) -> bool:
    messages = camera_frames.Messages().feed(raw)
    return all(camera_frames.pack_pair(camera_frames.parse_pair(body)) in raw for kind, body in messages if kind == camera_frames.Kind.PAIR)


def _rows(name: str, good: bytes, decode: Callable[[bytes], bool], frames: int) -> list[Row]:
    rng, failures, wrong = random.Random(name), 0, 0
    for _ in range(frames):
        try:
            wrong += not decode(_mutated(good, rng))
        except ProtocolError:
            continue
        except (ArithmeticError, LookupError, TypeError, ValueError, AttributeError):
            failures += 1
    return [
        Row("protocols", f"{name}: failures on {frames} broken frames", failures, "", "0"),
        Row("protocols", f"{name}: what no byte says, read from {frames} broken frames", wrong, "", "0"),
        Row("protocols", f"{name}: decoding", 1e6 * _time(decode, good), "µs"),
    ]


def _mutated(good: bytes, rng: random.Random) -> bytes:
    """A good frame with bytes changed, cut out or put in, or pure noise."""
    if rng.random() < 0.2:
        return rng.randbytes(rng.randrange(64))
    raw = bytearray(good)
    for _ in range(rng.randrange(1, 4)):
        place = rng.randrange(len(raw) + 1)
        kind = rng.random()
        if kind < 0.5 and place < len(raw):
            raw[place] = rng.randrange(256)
        elif kind < 0.75:
            del raw[place : place + rng.randrange(1, 9)]
        else:
            raw[place:place] = rng.randbytes(rng.randrange(1, 5))
    return bytes(raw)


def _time(decode: Callable[[bytes], object], good: bytes, rounds: int = 500) -> float:
    """CPU time of one good frame [s]."""
    times = []
    for _ in range(rounds):
        before = time.thread_time()
        decode(good)
        times.append(time.thread_time() - before)
    return float(np.median(times))
