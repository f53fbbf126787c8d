"""The one loop that serves every body."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from hardware.hal import Recorded, Robot
from hardware.recorder import Recorder
from scripts.runs.record import KeyFrame
from slam.messages import Estimate, LaserScan, SensorFrame, Status, Trajectory
from slam.navigation.policies import Policy
from slam.pipelines import Pipeline
from slam.scans import deskew
from slam.se2 import SE2
from slam.snapshot import Snapshot

PERIOD = 0.04
"""Time between control steps [s]; two encoder periods, so that a frame ends on a fresh encoder reading."""
KEY_FRAMES = 60
"""Moments kept for the animation."""

NO_MOTION = Trajectory(np.empty(0), np.empty((0, 3)))


@dataclass
class RunLog:
    """What a run has said so far."""

    stamps: list[float] = field(default_factory=list)
    poses: list[SE2] = field(default_factory=list)
    statuses: list[Status] = field(default_factory=list)
    odometry: dict[float, SE2] = field(default_factory=dict)
    key_frames: list[KeyFrame] = field(default_factory=list)
    updates: list[float] = field(default_factory=list)
    """Wall time of each pipeline update [s]."""
    wall_time: float = 0.0
    interrupted: bool = False

    def add(self, frame: SensorFrame, estimate: Estimate) -> None:
        """Keep one frame's answer; a frame at the time of the one before replaces it."""
        if self.stamps and self.stamps[-1] >= estimate.stamp:
            del self.stamps[-1], self.poses[-1], self.statuses[-1]
        self.stamps.append(estimate.stamp)
        self.poses.append(estimate.T_map_base)
        self.statuses.append(estimate.status)
        self.odometry.update((reading.stamp, reading.T_odom_base) for reading in frame.odometry)


@dataclass
class Loop:
    """A robot, a pipeline and a policy, run until the time or the recording ends."""

    robot: Robot
    pipeline: Pipeline
    policy: Policy
    duration: float | None = None
    """[s]; None: as long as there is more."""
    recorder: Recorder | None = None
    true_pose: Callable[[float], SE2] | None = None
    """Truth for the recorder, never for the pipeline."""
    progress: Callable[[float], None] | None = None
    """Told the time since the start [s], once a control step."""

    def run(self) -> RunLog:
        """Run to the end, or to Ctrl-C: what has been said until then is kept."""
        log, clock = RunLog(), self.robot.clock
        start, began = clock.now(), time.perf_counter()
        span = self.robot.span[1] - self.robot.span[0] if isinstance(self.robot, Recorded) else (self.duration or 60.0)
        end = start + (span if self.duration is None else self.duration)
        step, next_key_frame = 1, start
        try:
            while clock.now() < end - 1e-9 and clock.sleep_until(min(start + step * PERIOD, end)):
                step += clock.now() >= start + step * PERIOD
                frame, snapshot = self._step(log)
                if frame.scans and frame.stamp >= next_key_frame:
                    log.key_frames.append(_key_frame(frame.scans[-1], snapshot))
                    next_key_frame = frame.stamp + span / KEY_FRAMES
                if self.progress is not None:
                    self.progress(frame.stamp - start)
        except KeyboardInterrupt:
            log.interrupted = True
        log.wall_time = time.perf_counter() - began
        return log

    def _step(self, log: RunLog) -> tuple[SensorFrame, Snapshot]:
        frame = self.robot.read()
        before = time.perf_counter()
        estimate = self.pipeline.update(frame)
        log.updates.append(time.perf_counter() - before)
        snapshot = self.pipeline.snapshot()
        command = self.policy(frame, estimate, snapshot)
        if command is not None:
            self.robot.drive(command)
        log.add(frame, estimate)
        if self.recorder is not None:
            if self.true_pose is not None:
                T_world_base = self.true_pose(frame.stamp)
                self.recorder.add_truth(frame.stamp, T_world_base.x, T_world_base.y, T_world_base.yaw)
            self.recorder.flush()
        return frame, snapshot


def _key_frame(scan: LaserScan, snapshot: Snapshot) -> KeyFrame:
    T_map_base = SE2.from_array(snapshot.trajectory.poses[-1]) if len(snapshot.trajectory) else SE2()
    points = T_map_base.transform(deskew(scan, NO_MOTION).points)
    return KeyFrame(scan.stamp, T_map_base, snapshot.map.geometry, snapshot.map.states(), points)
