"""The cache of compiled kernels on the disk."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

KERNEL = """
from slam.kernels.jit import njit

@njit
def doubled(x):
    return x + x
"""
CALL = """
import sys, time
import numpy as np
from doubling import doubled
value = np.ones(2, np.dtype(sys.argv[1])) * 3
while time.time() < float(sys.argv[2]):
    pass
assert doubled(value).tolist() == [6, 6], doubled(value)
assert doubled(value).dtype == value.dtype
print(sum(doubled.stats.cache_hits.values()))
"""
TYPES = ("float64", "float32", "int32", "int16")


def call(folder: Path, kind: str, begin: float) -> subprocess.Popen[str]:
    project = str(Path(__file__).parents[3])
    return subprocess.Popen(
        [sys.executable, "-c", CALL, kind, str(begin)], cwd=folder, env={"PYTHONPATH": project}, stdout=subprocess.PIPE, text=True
    )


def test_processes_that_compile_at_once_leave_a_cache_that_is_right(tmp_path: Path) -> None:
    (tmp_path / "doubling.py").write_text(KERNEL)
    begin = time.time() + 6.0
    first = [call(tmp_path, kind, begin) for kind in TYPES]
    assert all(process.communicate()[0].split() for process in first)
    later = [call(tmp_path, kind, 0.0).communicate()[0].split() for kind in TYPES]
    assert later == [["1"]] * len(TYPES)
