"""The verb `twin install`: copy the server to a brick with ev3dev and start it, over ssh."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from hardware.drivers import ev3dev_server
from hardware.drivers.errors import LinkError
from scripts.errors import UsageError
from scripts.options import parse

HELP = "copy the server to a brick with ev3dev and start it, over ssh"
PATIENCE = 60.0
"""Longest time for ssh [s]: a brick is slow."""
NAME = "bricktwin_server.py"
START = """set -e
cat > {name}.new
mv {name}.new {name}
if [ -f {name}.pid ]; then kill "$(cat {name}.pid)" 2>/dev/null || true; fi
nohup python3 {name} --port {port} > {name}.log 2>&1 < /dev/null &
echo $! > {name}.pid
sleep 2
cat {name}.log
kill -0 "$(cat {name}.pid)"
"""
"""Done by the brick's shell: take the script, end the one before, start the new one, say what it says."""


@dataclass(frozen=True)
class InstallOptions:
    """Copy the server to a brick with ev3dev and start it there, in place of one that runs already.

    $ twin install robot@ev3dev.local                    then: twin run --robot ev3 --ev3 ev3dev:ev3dev.local
    """

    host: Positional[Annotated[str, arg(metavar="HOST")]]
    """As ssh takes it: robot@ev3dev.local on a brick as it comes, whose password is maker."""
    port: Annotated[int, arg(metavar="N")] = ev3dev_server.PORT
    """TCP port to serve on."""
    ssh_port: Annotated[int, arg(metavar="N")] = 22
    """Of ssh on the brick."""


def main(argv: list[str]) -> int:
    """Install; returns the exit code."""
    options = parse(InstallOptions, argv, "install")
    if options.host.startswith("-"):
        raise UsageError(f"'{options.host}' is no host; write robot@ev3dev.local")
    said = _on_the_brick(options)
    place = options.host.rpartition("@")[2]
    print(f"{said.strip()}\ntwin run --robot ev3 --ev3 ev3dev:{place}:{options.port}")
    return 0


def _on_the_brick(options: InstallOptions) -> str:
    """What the brick says.

    Raises:
        LinkError: ssh fails, or the server does not start.
    """
    command = ["ssh", "-p", str(options.ssh_port), options.host, START.format(name=NAME, port=options.port)]
    script = Path(ev3dev_server.__file__).read_bytes()
    try:
        done = subprocess.run(command, input=script, capture_output=True, timeout=PATIENCE, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise LinkError("EV3", f"ssh does not work ({error})", "install ssh, and check that the brick is on and in the network") from error
    if done.returncode:
        problem = (done.stderr or done.stdout).decode(errors="replace").strip() or f"ssh ends with {done.returncode}"
        raise LinkError("EV3", f"the server does not start ({problem[-300:]})", "check the host, its password, and that ev3dev is on it")
    return done.stdout.decode(errors="replace")
