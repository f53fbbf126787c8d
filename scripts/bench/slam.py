"""`twin bench slam`: what `lidar_slam` reaches on the Intel lab and in the simulated worlds."""

from __future__ import annotations

import gc
import math
import os
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from scripts.bench.row import Row
from scripts.errors import UsageError
from scripts.experiments.drive import Course, Drive
from scripts.runs.execute import execute
from scripts.runs.options import RunOptions
from slam.evaluation.maps import distance_to_walls
from slam.evaluation.relations import read_relations, relation_error
from slam.evaluation.trajectory import Statistics, absolute_errors, align, interpolate_truth
from slam.mapping.lidar_slam import LidarSlam, LidarSlamPipeline
from slam.mapping.rbpf import Rbpf
from slam.messages import SensorFrame, Trajectory, Twist
from slam.pipelines import Finishing, Pipeline
from slam.se2 import SE2, FloatArray

WORLDS = (
    "aruco_room", "office", "apartment", "maze", "hall", "cave", "corridor", "office_random", "maze:seed=1", "maze:seed=2", "cave:seed=1",
)  # fmt: skip
GHOST = 0.10
"""An occupied cell farther than this from every true static surface is a ghost [m]."""


def run(smoke: bool) -> Iterator[Row]:
    """All rows, as they are known; a recording's only where there is one.

    Raises:
        UsageError: the recordings are not there.
    """
    tours = {world: Course(world, 20.0 if smoke else 380.0).drive() for world in (WORLDS[:1] if smoke else WORLDS)}
    yield from _intel(smoke)
    yield from _closures(tours)
    yield from _turn()
    for rows in (_people, _drift, _corridor, _particles):
        yield from rows(smoke)
    yield from _soak(120.0 if smoke else 3600.0)


def _intel(smoke: bool) -> list[Row]:
    folder = Path(os.environ.get("BRICKTWIN_DATA", Path(__file__).parents[3] / "shared" / "data")) / "intel-lab"
    if not folder.is_dir():
        raise UsageError(f"no public recordings at {folder}; set BRICKTWIN_DATA to the folder that holds intel-lab/")
    with tempfile.TemporaryDirectory() as out:
        options = RunOptions(
            robot=f"replay:{folder / 'intel.log'}", pipeline="lidar_slam", duration=300.0 if smoke else None, out=Path(out)
        )
        record = execute(options).record
    error = relation_error(record.final, record.odometry, read_relations(folder / "intel.relations"))
    span = float(record.estimate.stamps[-1] - record.estimate.stamps[0])
    return [
        Row("slam", "Intel lab, relation error, mean", error.translation_mean, "m", "≤ 0.044", "GMapping", 0.0456),
        Row("slam", "Intel lab, rotation error, mean", math.degrees(error.rotation_mean), "deg", "≤ 1.6", "GMapping", 1.64),
        Row("slam", "Intel lab, wall time", span / record.metrics["real_time_factor"], "s", "≤ 15", "Cartographer", 179.0),
    ]


def follow(pipeline: Pipeline, frames: Sequence[SensorFrame]) -> Trajectory:
    """The final trajectory over the frames."""
    for frame in frames:
        pipeline.update(frame)
    if isinstance(pipeline, Finishing):
        pipeline.finish()
    return pipeline.snapshot().trajectory


def _closures(tours: dict[str, Drive]) -> list[Row]:
    """Of all worlds: how many links are right, and how many revisits are closed."""
    right = made = closed = revisits = 0
    rows: list[Row] = []
    for world, tour in tours.items():
        pipeline = LidarSlam().build()
        trajectory = follow(pipeline, tour.frames)
        rows.append(Row("slam", f"{world}, position RMSE at scans", 1e3 * _rmse(tour.truth, trajectory), "mm"))
        errors = _link_errors(pipeline, tour)
        made, right = made + len(errors), right + sum(d <= 0.10 and turn <= math.radians(2.0) for d, turn in errors)
        found, there = _revisits(pipeline, tour)
        closed, revisits = closed + found, revisits + there
    return [
        *rows,
        Row("slam", f"loop closures that are right, of {made}", 100.0 * right / max(made, 1), "%", "≥ 99.5"),
        Row("slam", f"revisits that are closed, of {revisits}", 100.0 * closed / max(revisits, 1), "%", "≥ 80"),
    ]


def _link_errors(pipeline: LidarSlamPipeline, tour: Drive) -> list[tuple[float, float]]:
    """Distance [m] and turn [rad] between measured and true relative pose of all closures that are believed."""
    errors: list[tuple[float, float]] = []
    for link in pipeline.submaps.believed():
        if link.seen is not None:
            T_i_j = tour.pose(link.seen.stamp_i).inverse() @ tour.pose(link.seen.stamp_j)
            error = T_i_j.inverse() @ link.seen.T_i_j
            errors.append((math.hypot(error.x, error.y), abs(error.yaw)))
    return errors


def _revisits(pipeline: LidarSlamPipeline, tour: Drive) -> tuple[int, int]:
    """Scans that see again what a scan 10 s before saw: those tied to one of these, and all."""
    scans, closed, there = tour.spaced_scans(0.5), 0, 0
    submaps = pipeline.submaps_at(np.array([scan.stamp for scan in scans]))
    for j, now in enumerate(scans):
        seen = [i for i, before in enumerate(scans[:j]) if now.stamp - before.stamp >= 10.0 and tour.shared(before, now) >= 0.5]
        there += bool(seen)
        closed += any(submaps[i] == submaps[j] or pipeline.submaps.tied(submaps[i], submaps[j]) for i in seen)
    return closed, there


def _rmse(truth: Trajectory, estimate: Trajectory) -> float:
    true, estimated = interpolate_truth(truth, estimate)
    return Statistics.of(absolute_errors(true, estimated, align(true, estimated)).translation).rmse


def _turn() -> list[Row]:
    """Heading error after one turn on the spot at 2 rad/s, from the difference between its two ends."""
    spin = Course("aruco_room", 1.0 + math.tau / 2.0).drive(lambda now, _: Twist(0.0, 2.0) if now > 1.0 else Twist())
    trajectory = follow(LidarSlam().build(), spin.frames)
    ends = [SE2.from_array(trajectory.poses[k]) for k in (0, -1)]
    true = [spin.pose(float(trajectory.stamps[k])) for k in (0, -1)]
    error = (true[0].inverse() @ true[1]).inverse() @ (ends[0].inverse() @ ends[1])
    return [Row("slam", "a full turn at 2 rad/s, heading error", math.degrees(abs(error.yaw)), "deg", "≤ 1")]


def _people(smoke: bool) -> list[Row]:
    """The office with and without people walking: medians over seeds."""
    duration, seeds = (20.0, (1,)) if smoke else (190.0, (1, 2, 3, 4, 5))
    empty, peopled = (np.array([_office(people, duration, seed) for seed in seeds]) for people in (0, 5))
    ratio = float(np.median(peopled[:, 0]) / np.median(empty[:, 0]))
    return [
        Row("slam", f"office, ATE with 5 people over ATE without, medians of {len(seeds)} seeds", ratio, "x", "≤ 1.2"),
        Row("slam", "office with 5 people, ghosts of all occupied cells, worst seed", float(peopled[:, 1].max()), "%", "≤ 1"),
        Row("slam", "office without people, ghosts of all occupied cells, worst seed", float(empty[:, 1].max()), "%"),
    ]


def _office(people: int, duration: float, seed: int) -> tuple[float, float]:
    """Position RMSE [m] and share of ghosts [%]."""
    tour, pipeline = Course(f"office:people={people}", duration, seed).drive(), LidarSlam().build()
    trajectory = follow(pipeline, tour.frames)
    T_world_map = align(*interpolate_truth(tour.truth, trajectory))
    hits = T_world_map.transform(pipeline.snapshot().map.wall_points())
    return _rmse(tour.truth, trajectory), 100.0 * float((distance_to_walls(hits, tour.walls) > GHOST).mean())


def _drift(smoke: bool) -> list[Row]:
    """Odometry withheld, closure off: error of all steps of 10 m in the office's rooms."""
    tour = Course("office", 30.0 if smoke else 190.0).drive()
    frames = [SensorFrame(frame.stamp, scans=frame.scans, available=frozenset({"scans"})) for frame in tour.frames]
    trajectory = follow(LidarSlam(close_loops=False).build(), frames)
    offsets, turns = _steps(tour, trajectory, 2.0 if smoke else 10.0)
    return [
        Row("slam", "office, drift without odometry and closure, median of 10 m", 10.0 * float(np.median(offsets)), "%", "≤ 0.5"),
        Row(
            "slam",
            "office, heading drift without odometry and closure, median of 10 m",
            float(np.degrees(np.median(turns))),
            "deg",
            "≤ 0.3",
        ),
    ]


def _steps(tour: Drive, trajectory: Trajectory, length: float) -> tuple[FloatArray, FloatArray]:
    """Position [m] and heading [rad] errors of all steps along the true way that begin and end outside the corridor (y < 1.7 m)."""
    true = [tour.pose(float(stamp)) for stamp in trajectory.stamps]
    way = np.concatenate([[0.0], np.cumsum([math.hypot(b.x - a.x, b.y - a.y) for a, b in pairwise(true)])])
    offsets, turns = [0.0], [0.0]
    for i, j in enumerate(int(place) for place in np.searchsorted(way, way + length)):
        if j < len(true) and true[i].y > 1.7 and true[j].y > 1.7:
            estimated = SE2.from_array(trajectory.poses[i]).inverse() @ SE2.from_array(trajectory.poses[j])
            error = (true[i].inverse() @ true[j]).inverse() @ estimated
            offsets.append(math.hypot(error.x, error.y))
            turns.append(abs(error.yaw))
    return np.array(offsets[1:] or offsets), np.array(turns[1:] or turns)


def _corridor(smoke: bool) -> list[Row]:
    """Largest error along the axis, from the start, against wheel odometry's."""
    tour = Course("corridor", 20.0 if smoke else 45.0).drive()
    trajectory = follow(LidarSlam().build(), tour.frames)
    odometry = {reading.stamp: reading.T_odom_base for frame in tour.frames for reading in frame.odometry}
    wheels = Trajectory(np.array(list(odometry)), np.array([pose.as_array() for pose in odometry.values()]))
    ours, floor = (_along(tour, path) for path in (trajectory, wheels))
    return [Row("slam", "corridor, error along the axis over wheel odometry's", ours / floor, "x", "≤ 1.05")]


def _along(tour: Drive, path: Trajectory) -> float:
    true = [tour.pose(float(stamp)) for stamp in path.stamps]
    T_world_path = true[0] @ SE2.from_array(path.poses[0]).inverse()
    return max(abs((T_world_path @ SE2.from_array(row)).x - pose.x) for row, pose in zip(path.poses, true, strict=True))


def _particles(smoke: bool) -> list[Row]:
    """Time of `rbpf` where every scan is an update, in the second half of a drive."""
    tour, pipeline = Course("office", 5.0 if smoke else 30.0).drive(), Rbpf(distance=0.0, yaw=0.0).build()
    times: list[float] = []
    for frame in tour.frames:
        began = time.perf_counter()
        pipeline.update(frame)
        if frame.scans:
            times.append(time.perf_counter() - began)
    median = 1e3 * float(np.median(times[len(times) // 2 :]))
    return [Row("slam", "`rbpf`, 30 particles, median time per update", median, "ms", "≤ 20", "GMapping, published", 240.0)]


def _soak(duration: float) -> list[Row]:
    """Growth of the memory over the second half of a long run round and round a room, beyond the twin's own."""
    with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as fresh:  # what one run has freed the next would use again
        mapping, twin = fresh.map(_growth, (duration, duration), (True, False))
    growth = mapping - twin
    return [Row("slam", f"memory growth in the second half of {duration:g} s", growth, "MB", "≤ 5 in an hour")]


def _growth(duration: float, mapping: bool) -> float:
    """Of this process [MB]; the twin keeps its truth."""
    half, pipeline = 0.0, LidarSlam().build() if mapping else None
    for frame in Course("aruco_room", duration).frames():
        if pipeline is not None:
            pipeline.update(frame)
        if half == 0.0 and frame.stamp > 0.5 * duration:
            half = _resident_mb()
    return _resident_mb() - half


def _resident_mb() -> float:
    gc.collect()
    return int(Path("/proc/self/status").read_text(encoding="ascii").split("VmRSS:")[1].split()[0]) / 1024.0
