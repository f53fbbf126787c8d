"""Every method on the same recordings: what `paper_table` and `paper_plot` show.

    given = mapped("office:people=0", 300.0, seed=100)               # a map, made once
    drive = Course("office:people=5", 200.0, seed=1).drive()         # a recording
    runs = contest(given, drive, seed=1, methods=methods())          # every localizer and odometry on it
    runs = contest(given, drive, 1, methods("amcl", "mcl", robust=Amcl(...)), condition="crowd")
    Console(width=150).print(paper_table("title", runs, PAPER))      # PAPER: what the paper reports
    write_results(folder, "title", runs, given)                     # table.csv, errors.csv and errors.png

A `Run` keeps errors, claimed deviations and true places over time; `run.where(mask)` narrows it to a region or a stretch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scripts.experiments.arena import Outcome, WorldErrors, errors_in, follow, start_in
from scripts.experiments.drive import Drive
from scripts.runs.known_map import GivenMap
from slam.errors import UnknownNameError
from slam.evaluation.poses import transform
from slam.evaluation.trajectory import interpolate_truth
from slam.mapping.odometry import Odometry
from slam.messages import Status
from slam.pipelines import LOCALIZERS, LocalizerSettings, Pipeline, warm_up
from slam.se2 import SE2, FloatArray

Method = LocalizerSettings | Odometry
"""Parameters of a localizer, or wheels and gyro alone."""


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """One method on one recording."""

    method: str
    condition: str
    """What is special about the recording; empty where there is but one kind."""
    seed: int
    errors: WorldErrors
    """In the world's axes."""
    places: FloatArray
    """(N, 3) true poses in the world at the same stamps [m, rad]."""
    deviations: FloatArray
    """(N, 2) what the method claims: standard deviation of the position along its worst axis [m], of the heading [rad]."""
    lost: FloatArray
    """(N,) 1 where the method says that it is lost or that the place is ambiguous, else 0."""
    update_ms: FloatArray
    """CPU time of each update that had a scan or an image [ms]."""

    def where(self, chosen: FloatArray) -> Run:
        """The moments chosen by a mask (N,)."""
        errors, parts = self.errors.where(chosen), (self.places[chosen], self.deviations[chosen], self.lost[chosen])
        return replace(self, errors=errors, places=parts[0], deviations=parts[1], lost=parts[2])


def methods(*names: str, **variants: Method) -> dict[str, Method]:
    """Odometry, the localizers named (all there are by default, none where only variants are given) and variants of one's own.

    Raises:
        UnknownNameError: no such localizer.
    """
    chosen: dict[str, Method] = {"odometry": Odometry()}
    for name in names or (() if variants else sorted(LOCALIZERS)):
        if name not in (*LOCALIZERS, "odometry"):
            raise UnknownNameError("localizer", name, sorted([*LOCALIZERS, "odometry"]))
        chosen[name] = Odometry() if name == "odometry" else LOCALIZERS[name]()
    return {**chosen, **variants}


def contest(
    given: GivenMap, drive: Drive, seed: int, methods: Mapping[str, Method], condition: str = "", start: SE2 | None = None
) -> list[Run]:
    """Run every method on a recording, from the true start or the `T_map_base` that is given."""
    start = start or start_in(given, drive)
    runs: list[Run] = []
    for name, settings in methods.items():
        warm_up(_built(settings, given, start))
        runs.append(run_of(name, given, drive, follow(_built(settings, given, start), drive), seed, condition))
    return runs


def run_of(method: str, given: GivenMap, drive: Drive, outcome: Outcome, seed: int, condition: str = "") -> Run:
    """Score an outcome."""
    truth, _ = interpolate_truth(drive.truth, outcome.estimate)
    kept = np.isin(outcome.estimate.stamps, truth.stamps)
    covariances = outcome.covariances[kept]
    worst = np.sqrt(np.maximum(np.linalg.eigvalsh(covariances[:, :2, :2])[:, -1], 0.0))
    deviations = np.column_stack([worst, np.sqrt(np.maximum(covariances[:, 2, 2], 0.0))])
    lost = np.array([status in (Status.LOST, Status.AMBIGUOUS) for status in outcome.statuses], np.float64)[kept]
    errors = errors_in(given, drive, outcome.estimate)
    return Run(method, condition, seed, errors, truth.poses, deviations, lost, outcome.update_ms)


def path_in_world(run: Run) -> FloatArray:
    """(N, 2) where the method believed the robot to be [m]."""
    return run.places[:, :2] + np.column_stack([run.errors.x, run.errors.y])


def first_seed(runs: Sequence[Run]) -> list[Run]:
    """Those of the lowest seed."""
    return [run for run in runs if run.seed == min(run.seed for run in runs)]


def walls_in_world(given: GivenMap) -> FloatArray:
    """(N, 2) hits of the map's walls [m]."""
    hits = given.known.grid.wall_points()
    return transform(given.T_world_map, np.column_stack([hits, np.zeros(len(hits))]))[:, :2]


def _built(settings: Method, given: GivenMap, start: SE2) -> Pipeline:
    return settings.build(start) if isinstance(settings, Odometry) else settings.build(given.known, start)
