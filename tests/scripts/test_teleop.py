import os
import pty
import re
import select
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hardware.replay import Replay
from scripts.cli import main


class Terminal:
    """The verb on a terminal of its own."""

    def __init__(self, *options):
        self.master, slave = pty.openpty()
        command = [sys.executable, "-m", "scripts.cli", "teleop", "--robot", "kinematic", *options]
        self.process = subprocess.Popen(command, stdin=slave, stdout=slave, stderr=slave, cwd=Path(__file__).parents[2])
        os.close(slave)
        self.said = ""

    def listen(self, seconds):
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            if not select.select([self.master], [], [], left)[0]:
                break
            try:
                self.said += os.read(self.master, 4096).decode()
            except OSError:  # the other end is closed
                break

    def wait_for(self, pattern, seconds=40.0):
        end = time.monotonic() + seconds
        while not re.search(pattern, self.said) and time.monotonic() < end:
            self.listen(0.05)
        assert re.search(pattern, self.said), self.said[-300:]

    def press(self, keys):
        self.said = ""
        os.write(self.master, keys)


@pytest.fixture
def terminal(tmp_path):
    terminal = Terminal("--record", str(tmp_path / "drive"))
    terminal.wait_for(r"\+0\.00 m/s", 120.0)
    yield terminal
    terminal.process.kill()
    terminal.process.communicate()
    os.close(terminal.master)


@pytest.mark.wall_clock
def test_keys_drive_silence_stops_and_x_leaves_a_recording(terminal, tmp_path):
    terminal.press(b"w")
    terminal.wait_for(r"\+0\.1\d m/s \+0\.00")
    terminal.wait_for(r"\+0\.1\d m/s(.|\r)*\+0\.00 m/s")  # nobody touched another key
    terminal.press(b"\x1b[D")
    terminal.wait_for(r"\+0\.[78]\d rad/s")
    terminal.press(b" ")
    terminal.wait_for(r"\+0\.00 m/s \+0\.00 rad/s")
    terminal.press(b"s")
    terminal.wait_for(r"-0\.1\d m/s")
    terminal.press(b"x")
    terminal.listen(5.0)
    assert terminal.process.wait(10.0) == 0
    commands = [event.message.twist for event in Replay(tmp_path / "drive").build().log.events() if event.channel == "commands"]
    assert max(twist.v for twist in commands) > 0.1
    assert commands[0].v == 0.0


@pytest.mark.parametrize(("arguments", "words"), [([], "start it in a terminal"), (["--speed", "x"], "--speed must be a number")])
def test_mistakes_are_one_line(capsys, arguments, words):
    assert main(["teleop", *arguments]) == 2
    assert words in capsys.readouterr().err
