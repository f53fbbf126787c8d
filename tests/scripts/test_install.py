import os
import signal
import socket
import stat
import sys
import time
from contextlib import suppress

import pytest

from hardware.emulators.ev3dev_tree import Ev3devTree
from scripts.cli import main

FAKE = """#!/bin/sh
# as sshd does: a shell in the user's home runs the last argument
for command; do :; done
cd "$BRICK_HOME" && exec sh -c "$command"
"""


@pytest.fixture
def brick(tmp_path, monkeypatch):
    """The home of a brick that is reached by a stand-in for ssh; its python3 sees the emulated files."""
    programs, home = tmp_path / "bin", tmp_path / "home"
    programs.mkdir()
    home.mkdir()
    for name, text in (("ssh", FAKE), ("python3", f'#!/bin/sh\nexec {sys.executable} -S "$@" --host 127.0.0.1 --root {tmp_path}/class\n')):
        (programs / name).write_text(text)
        (programs / name).chmod(stat.S_IRWXU)
    monkeypatch.setenv("PATH", f"{programs}:{os.environ['PATH']}")
    monkeypatch.setenv("BRICK_HOME", str(home))
    yield home
    pid = home / "bricktwin_server.py.pid"
    with suppress(FileNotFoundError, ProcessLookupError):
        os.kill(int(pid.read_text()), signal.SIGKILL)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.mark.wall_clock
def test_one_command_copies_the_server_and_starts_it_and_a_second_one_replaces_it(brick, rollers, tmp_path, capsys):
    port, pids = free_port(), []
    with Ev3devTree(rollers, tmp_path / "class"):
        for _ in range(2):
            assert main(["install", "robot@127.0.0.1", "--port", str(port)]) == 0
            assert f"--ev3 ev3dev:127.0.0.1:{port}" in capsys.readouterr().out
            pids.append(int((brick / "bricktwin_server.py.pid").read_text()))
            with socket.create_connection(("127.0.0.1", port), 2.0) as client:
                client.sendall(b"ports A D 4\n")
                assert client.recv(64) == b"ok *DA\n"
    assert pids[0] != pids[1]
    time.sleep(0.1)
    with pytest.raises(ProcessLookupError):
        os.kill(pids[0], 0)


def test_a_server_that_does_not_start_is_one_line(brick, capsys):
    assert main(["install", "robot@127.0.0.1", "--port", str(free_port())]) == 2
    said = capsys.readouterr().err
    assert "the server does not start" in said
    assert said.count("\n") == 1


def test_a_host_that_is_an_option_is_refused(capsys):
    assert main(["install", "--", "-oProxyCommand=x"]) == 2
    assert "no host" in capsys.readouterr().err
