"""What stands at the far end of the wire: `twin emulate` in a process of its own, or a twin and its ports in this one."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from scripts.errors import UsageError

ANYWHERE = "tcp:127.0.0.1:0"
WORLD = "hall"
"""Room to all sides of its start."""
ROOT = Path(__file__).parents[3]


class Devices(NamedTuple):
    """Where the emulated devices are."""

    brick: str
    lidar: str


@contextmanager
def emulated(*options: str) -> Generator[Devices, None, None]:
    """`twin emulate` on free ports, with options, for the length of a `with` block.

    Raises:
        UsageError: it does not start.
    """
    command = [sys.executable, "-m", "scripts.cli", "emulate", "--robot", "kinematic", "--ev3", ANYWHERE, "--lidar", ANYWHERE, *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT)
    try:
        assert process.stdout is not None
        said = process.stdout.readline()
        places = re.findall(r"(?:brick|lidar) at (\S+),", said)
        if len(places) != len(Devices._fields):
            raise UsageError(f"`twin emulate {' '.join(options)}` does not start; try it by hand")
        yield Devices(*places)
    finally:
        process.terminate()
        process.communicate()
