"""The one loop that serves every body."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hardware.hal import Recorded, Robot
from hardware.recorder import Recorder
from scripts.runs.marker_views import MarkerView, marker_view
from scripts.runs.record import KeyFrame, belief_row
from slam.grid import GridGeometry, OccupancyGrid
from slam.messages import Estimate, LaserScan, SensorFrame, Status, Trajectory
from slam.navigation.outcome import Concluding
from slam.navigation.policies import Policy
from slam.pipelines import Pipeline
from slam.scans import deskew
from slam.se2 import SE2
from slam.snapshot import Snapshot

PERIOD = 0.04
"""Time between control steps [s]; two encoder periods, so that a frame ends on a fresh encoder reading."""
KEY_FRAMES = 70
"""Most moments kept for the animation."""
PICTURE_CELLS = 800
"""Most cells to each side of their maps: a large map is not kept so often in full."""

PICTURE_PARTICLES = 500
"""Most particles that a picture shows."""

NO_MOTION = Trajectory(np.empty(0), np.empty((0, 3)))


@dataclass
class RunLog:
    """What a run has said so far."""

    stamps: list[float] = field(default_factory=list)
    poses: list[SE2] = field(default_factory=list)
    statuses: list[Status] = field(default_factory=list)
    odometry: dict[float, SE2] = field(default_factory=dict)
    key_frames: list[KeyFrame] = field(default_factory=list)
    beliefs: list[tuple[float, float, float, float, float]] = field(default_factory=list)
    """Rows of `ParticleHistory`, one at each snapshot."""
    updates: list[float] = field(default_factory=list)
    """Wall time of each pipeline update [s]."""
    wall_time: float = 0.0
    interval: float = 0.25
    """Time between key frames [s]; it doubles as the run goes on."""

    def add(self, frame: SensorFrame, estimate: Estimate) -> None:
        """Keep one frame's answer; a frame at the time of the one before replaces it."""
        if self.stamps and self.stamps[-1] >= estimate.stamp:
            del self.stamps[-1], self.poses[-1], self.statuses[-1]
        self.stamps.append(estimate.stamp)
        self.poses.append(estimate.T_map_base)
        self.statuses.append(estimate.status)
        self.odometry.update((reading.stamp, reading.T_odom_base) for reading in frame.odometry)

    def is_due(self, stamp: float) -> bool:
        """Whether it is time for another moment."""
        return not self.key_frames or stamp >= self.key_frames[-1].stamp + self.interval

    def add_moment(self, scan: LaserScan, snapshot: Snapshot, view: MarkerView | None) -> None:
        """Keep a moment for the animation; when there are too many every other one goes."""
        self.key_frames.append(_key_frame(scan, snapshot, view))
        if len(self.key_frames) > KEY_FRAMES:
            del self.key_frames[1::2]
            self.interval *= 2.0


@dataclass
class Loop:
    """A robot, a pipeline and a policy, run until the time or the recording ends."""

    robot: Robot
    pipeline: Pipeline
    policy: Policy
    stopped: Callable[[], bool]
    """Asked between two steps whether to end the run."""
    duration: float = math.inf
    """[s]"""
    recorder: Recorder | None = None
    true_pose: Callable[[float], SE2] | None = None
    """Truth for the recorder, never for the pipeline."""
    progress: Callable[[float], None] = lambda now: None
    """Told the time since the start [s], once a control step."""

    def run(self, log: RunLog) -> None:
        """Run to the end and keep what is said in `log`: it is right up to the last whole step, whatever ends the run."""
        clock, snapshot = self.robot.clock, self.pipeline.snapshot()
        start, began, step = clock.now(), time.perf_counter(), 1
        end = start + self.duration
        if isinstance(self.robot, Recorded):  # large maps are not copied more often than needed
            log.interval = max(log.interval, 2.0 * (min(self.robot.span[1], end) - start) / KEY_FRAMES)
        concluding = self.policy if isinstance(self.policy, Concluding) else None  # asking a protocol takes its time
        while not self.stopped() and (concluding is None or concluding.outcome is None) and clock.now() < end - 1e-9:
            tick = round(start + step * PERIOD, 9)
            if not clock.sleep_until(min(tick, end)):
                break
            step = max(step, math.floor((clock.now() - start) / PERIOD + 1e-6) + 1)
            snapshot = self._step(log, snapshot)
            log.wall_time = time.perf_counter() - began
            self.progress(clock.now() - start)

    def _step(self, log: RunLog, snapshot: Snapshot) -> Snapshot:
        """One round from the sensors to the wheels; returns what is known after it."""
        frame = self.robot.read()
        before = time.perf_counter()
        estimate = self.pipeline.update(frame)
        log.updates.append(time.perf_counter() - before)
        moment = bool(frame.scans) and log.is_due(frame.scans[-1].stamp)
        if moment or (frame.scans and not isinstance(self.robot, Recorded)):  # copying a large map has its price
            snapshot = self.pipeline.snapshot()
            if len(snapshot.particles):
                log.beliefs.append(belief_row(frame.stamp, snapshot.particles))
        if moment:
            log.add_moment(frame.scans[-1], snapshot, marker_view(self.pipeline, estimate))
        command = self.policy(frame, estimate, snapshot)
        if command is not None:
            self.robot.drive(command)
        log.add(frame, estimate)
        if self.recorder is not None:
            self._record(self.recorder, frame.stamp)
        return snapshot

    def _record(self, recorder: Recorder, stamp: float) -> None:
        if self.true_pose is not None:
            T_world_base = self.true_pose(stamp)
            recorder.add_truth(stamp, T_world_base.x, T_world_base.y, T_world_base.yaw)
        recorder.flush()


def _key_frame(scan: LaserScan, snapshot: Snapshot, view: MarkerView | None) -> KeyFrame:
    T_map_base = SE2.from_array(snapshot.trajectory.poses[-1]) if len(snapshot.trajectory) else SE2()
    points = T_map_base.transform(deskew(scan, NO_MOTION).points)
    particles = snapshot.particles[:: 1 + len(snapshot.particles) // PICTURE_PARTICLES]
    return KeyFrame(scan.stamp, T_map_base, *_coarse(snapshot.map), points, particles, snapshot.localizability, view)


def _coarse(grid: OccupancyGrid) -> tuple[GridGeometry, NDArray[np.int8]]:
    """The map for a small picture: blocks of cells are occupied when one cell is, free when one is and none is occupied."""
    geometry, states = grid.geometry, grid.states()
    block = math.ceil(max(states.shape) / PICTURE_CELLS)
    for axis, size in enumerate(states.shape):
        states = np.maximum.reduceat(states, np.arange(0, size, block), axis)
    return GridGeometry(geometry.resolution * block, states.shape[1], states.shape[0], geometry.T_map_grid), states
