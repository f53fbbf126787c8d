"""The pytest plug-in: the fixture `twin_run`, for headless tests with ground truth."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import pytest

if TYPE_CHECKING:  # pytest loads this plug-in for every test run of the environment; most of them start no robot
    from hardware.fault_kinds import Fault
    from scripts.runs.record import RunRecord


class TwinRun(Protocol):
    """What the fixture is."""

    def __call__(self, *, faults: Sequence[Fault] = (), **options: object) -> RunRecord:
        """Run a robot with faults and with the options of `twin run`; returns all that is known of the run, metrics included."""
        ...


@pytest.fixture
def twin_run(tmp_path: Path) -> TwinRun:
    """Runs a robot as `twin run` does, without pictures: `twin_run(world="corridor", duration=10).metrics["position_rmse_m"]`."""
    from scripts.runs.execute import measure
    from scripts.runs.options import RunOptions

    def run(*, faults: Sequence[Fault] = (), **options: object) -> RunRecord:
        chosen: dict[str, Any] = {"out": tmp_path / "twin_run", **options}
        return measure(RunOptions(**chosen), faults)

    return run
