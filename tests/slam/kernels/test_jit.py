"""The cache of compiled kernels on the disk."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

KERNEL = """
from slam.kernels.jit import njit

@njit
def doubled(x):
    return x + x
"""
CALL = """
import sys
import numpy as np
from doubling import doubled
values = [np.ones(2, np.dtype(kind)) * 3 for kind in sys.argv[1:]]
print("ready", flush=True)
sys.stdin.readline()
for value in values:
    assert doubled(value).tolist() == [6, 6], doubled(value)
    assert doubled(value).dtype == value.dtype
print(sum(doubled.stats.cache_hits.values()))
"""
TYPES = ("float64", "float64", "float64", "int32", "int16")


def caller(folder: Path, *kinds: str) -> subprocess.Popen[str]:
    environment = {"PYTHONPATH": str(Path(__file__).parents[3])}
    pipe = subprocess.PIPE
    return subprocess.Popen([sys.executable, "-c", CALL, *kinds], cwd=folder, env=environment, stdin=pipe, stdout=pipe, text=True)


def test_of_processes_that_need_a_kernel_at_once_one_compiles_it_and_the_cache_is_right(tmp_path: Path) -> None:
    (tmp_path / "doubling.py").write_text(KERNEL)
    processes = [caller(tmp_path, kind) for kind in TYPES]
    assert [process.stdout.readline() for process in processes] == ["ready\n"] * len(TYPES)
    for process in processes:
        process.stdin.write("go\n")
        process.stdin.flush()
    hits = [int(process.communicate()[0]) for process in processes]
    assert (sum(hits[:3]), *hits[3:]) == (2, 0, 0)
    later, _ = caller(tmp_path, *TYPES[2:]).communicate("go\n")
    assert later.split() == ["ready", "3"]
