"""`twin bench envs`: steps of the environments in a second, and maps for them."""

from __future__ import annotations

import os
import time
from typing import Any

import gymnasium
import numpy as np

import sim.envs  # noqa: F401 (registers)
from scripts.bench.row import Row
from sim.envs.site import site_of
from worlds.loader import load_world
from worlds.splits import FAMILIES, map_names

GROUP = "envs"
ID = "bricktwin/Explore-v0"
MANY = 32


def run(smoke: bool) -> list[Row]:
    """Rows of speed."""
    steps = 20 if smoke else 400
    native, robot = _steps_per_second(steps, {}), _steps_per_second(steps // 2, {"native": False})
    return [
        Row(
            GROUP,
            "Explore-v0 kinematic, kernel, 181 beams, one env, CPU time",
            native,
            "steps/s",
            "≥ 10 k",
            "Robot path",
            robot,
            native / robot,
        ),
        *_vector_rows(2 if smoke else 100, 4 if smoke else MANY),
        Row(GROUP, "Explore-v0 sim, 682 beams, CPU time", _steps_per_second(steps // 2, {"robot": "sim"}), "steps/s", "≥ 150"),
        *_map_rows(8 if smoke else 80),
    ]


def _steps_per_second(steps: int, options: dict[str, Any]) -> float:
    """Median over the families of medium maps, in CPU time of this thread: others may use the machine too."""
    rates: list[float] = []
    for name in map_names("test", "medium")[: 3 if options.get("robot") == "sim" else len(FAMILIES)]:
        env = gymnasium.make(ID, world=name.text, **options)
        env.reset(seed=0)
        actions = _actions(steps + 5, 1)[:, 0]
        for action in actions[:5]:
            env.step(action)
        began = time.thread_time()
        for action in actions[5 : steps + 5]:
            env.step(action)
        rates.append(steps / (time.thread_time() - began))
        env.close()
    return float(np.median(rates))


def _actions(steps: int, count: int) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Actions (steps, count, 2) that change every second."""
    drawn = np.random.default_rng(0).uniform((0.2, -0.3), (0.8, 0.3), (steps // 10 + 1, count, 2))
    return np.repeat(drawn, 10, axis=0).astype(np.float32)


def _vector_rows(steps: int, count: int) -> list[Row]:
    envs = gymnasium.make_vec(ID, count, split="test", difficulty="medium")
    envs.reset(seed=0)
    actions = _actions(steps + 2, count)
    envs.step(actions[0])
    began, busy = time.perf_counter(), time.process_time()
    for action in actions[1 : steps + 1]:
        envs.step(action)
    wall, busy = time.perf_counter() - began, time.process_time() - busy
    envs.close()
    cores = min(os.cpu_count() or 1, 2)
    return [
        Row(GROUP, f"Explore-v0 kinematic, {count} envs by make_vec, wall time", count * steps / wall, "steps/s", "≥ 15 k (two cores)"),
        Row(
            GROUP,
            f"Explore-v0 kinematic, {count} envs by make_vec, CPU time of {cores} cores",
            cores * count * steps / busy,
            "steps/s",
            "≥ 15 k",
        ),
    ]


def _map_rows(count: int) -> list[Row]:
    names = map_names("train")[1000 : 1000 + count]
    began = time.thread_time()
    for name in names:
        load_world(name.text)
    made = time.thread_time()
    for name in names:
        site_of(name.text)
    ready = time.thread_time()
    return [
        Row(GROUP, "a map of the training split", 1e3 * (made - began) / count, "ms"),
        Row(GROUP, "its reachable area", 1e3 * (ready - made) / count, "ms"),
    ]
