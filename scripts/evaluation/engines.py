"""Who runs the trials: processes of this machine, or the nodes of a Ray cluster. The episodes are the same."""

from __future__ import annotations

import importlib
import socket
import sys
from collections.abc import Iterator, Sequence
from types import ModuleType

from rich.console import Console
from rich.progress import track

from scripts.errors import UsageError
from scripts.evaluation.episode import Episode, Trial, run
from scripts.processes import spread

PATIENCE = 5.0
"""Longest time for a cluster to answer [s]."""
REMEDY = "start one with `ray start --head`, or give no --address for one that is this machine alone"


def run_all(trials: Sequence[Trial], engine: str, address: str, processes: int) -> list[Episode]:
    """All episodes, in the order of the trials whoever runs them.

    Raises:
        UsageError: the engine is not installed, or does not answer.
        SimError, WorldError: a trial cannot be run.
    """
    if address and engine != "ray":
        raise UsageError(f"--address {address} is that of a Ray cluster; add --engine ray")
    episodes = _on_ray(trials, address) if engine == "ray" else spread(run, trials, processes)
    return list(track(episodes, "episodes", total=len(trials), console=Console(stderr=True)))


def _on_ray(trials: Sequence[Trial], address: str) -> Iterator[Episode]:
    ray = _ray()
    try:
        _knock(address)
        ray.init(address=address or "local", log_to_driver=False, include_dashboard=None if address else False, logging_level="error")
    except (OSError, ValueError, RuntimeError) as error:
        raise UsageError(f"no Ray cluster answers at '{address}' ({str(error).splitlines()[0]}); {REMEDY}") from error
    try:
        task = ray.remote(num_cpus=1)(_run_on_node)
        waiting = [task.remote(trial) for trial in trials]
        nodes = set[str]()
        for result in waiting:
            node, episode = ray.get(result)
            nodes.add(node)
            yield episode
        print(f"{len(trials)} episodes by Ray on {len(nodes)} node{'s' * (len(nodes) != 1)}", file=sys.stderr)
    finally:
        ray.shutdown()


def _knock(address: str) -> None:
    """Fail at once where nothing listens: Ray itself tries for minutes."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if port.isdigit():
        socket.create_connection((host, int(port)), PATIENCE).close()


def _run_on_node(trial: Trial) -> tuple[str, Episode]:
    return _ray().get_runtime_context().get_node_id(), run(trial)


def _ray() -> ModuleType:
    try:
        return importlib.import_module("ray")
    except ImportError as error:
        raise UsageError("--engine ray needs Ray: pip install 'bricktwin[ray]'") from error
