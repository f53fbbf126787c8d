"""PyBullet, imported without the build time that it prints on standard error."""

from __future__ import annotations

import os
import sys

sys.stderr.flush()
_stderr, _silence = os.dup(2), os.open(os.devnull, os.O_WRONLY)
os.dup2(_silence, 2)
try:
    import pybullet
finally:
    os.dup2(_stderr, 2)
    os.close(_stderr)
    os.close(_silence)

__all__ = ["pybullet"]
