"""The `lidar_slam` pipeline: scan to submap, submaps that are regions, loop closure, a robust pose graph between submaps."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from slam.errors import require_not_negative
from slam.grid import OccupancyGrid
from slam.mapping.front_end import FrontEnd, Tracking
from slam.mapping.grid_mapper import FULL, MapSettings
from slam.mapping.loop_closing import Here, LoopCloser
from slam.mapping.polish import Polish, Polished, polish
from slam.mapping.recognition import LoopClosing
from slam.mapping.region import Region
from slam.mapping.rendering import render
from slam.mapping.session import load_session, save_session
from slam.mapping.submap_chain import SubmapChain
from slam.mapping.submap_path import SubmapPath
from slam.mapping.submaps import Submaps
from slam.mapping.uncertainty import composed, from_body, to_body
from slam.messages import Estimate, LaserScan, SensorFrame, Status
from slam.motion.keyframes import KeyframeGate
from slam.motion.sensor_watch import SensorWatch
from slam.scans import PointScan
from slam.se2 import SE2, FloatArray
from slam.snapshot import Snapshot


@dataclass(frozen=True, slots=True)
class LidarSlam:
    """Lidar SLAM with loop closure."""

    map: MapSettings = field(default_factory=MapSettings)
    tracking: Tracking = field(default_factory=Tracking)
    keyframes: KeyframeGate = field(default_factory=KeyframeGate)
    attempts: KeyframeGate = field(default_factory=lambda: KeyframeGate(0.5, 0.5))
    """Motion between two attempts to recognise other submaps."""
    closing: LoopClosing = field(default_factory=LoopClosing)
    polish: Polish = field(default_factory=Polish)
    region: Region = field(default_factory=Region)
    entry_known: float = 0.8
    """Share of a scan's points that an older submap must know for the robot to go on in it."""
    close_loops: bool = True
    """Recognise submaps; without it the pipeline is lidar odometry."""
    mapping: bool = True
    """Extend the map of a session; without it the robot is only localised in it."""

    def __post_init__(self) -> None:
        require_not_negative(self, "entry_known")

    def build(self, T_map_base: SE2 | None = None) -> LidarSlamPipeline:
        """Make the pipeline; the robot starts at `T_map_base`, the origin by default."""
        return LidarSlamPipeline(self, T_map_base or SE2())


class LidarSlamPipeline:
    """Tracks in the current submap; `T_map_odom` jumps when the graph moves that submap, `T_odom_base` never."""

    def __init__(self, settings: LidarSlam, T_map_base: SE2) -> None:
        self._settings = settings
        self._start = T_map_base
        self._watch = SensorWatch()
        self.front = FrontEnd(settings.tracking, SE2())
        self._path = SubmapPath()
        self._inserted: SE2 | None = None  # T_current_base of the last scan inserted
        self._attempted: SE2 | None = None
        self._open(Submaps())
        self._unplaced = False  # a session is loaded, and the robot has not been found in it
        self._moved = math.inf  # time of the newest odometry in the last estimate
        self._placed: tuple[SE2, SE2, FloatArray] = (T_map_base, T_map_base, np.zeros((3, 3)))  # T_map_base, T_map_odom, covariance
        self._frozen: OccupancyGrid | None = None
        self._polished: Polished | None = None

    @property
    def current(self) -> int:
        """Number of the submap that is tracked in."""
        return self._chain.current

    def update(self, frame: SensorFrame) -> Estimate:
        """Register the frame's scans and answer with the pose at the frame's time."""
        self.front.ego.hear(frame)
        for scan in frame.scans:
            self._polished = None
            self._register(scan)
        return self._estimate(frame)

    def snapshot(self) -> Snapshot:
        """The map and the poses at scans so far."""
        if self._polished is not None:
            return Snapshot(self._polished.map, self._polished.trajectory)
        if self._frozen is None:
            self._frozen = render(self._chain.all, self._settings.map.resolution).frozen_copy()
        return Snapshot(self._frozen, self._path.trajectory(self.submaps.all))

    def finish(self) -> None:
        """Make the map anew from the kept scans, and refine it and the poses: `snapshot` shows it until another scan comes."""
        if self._settings.mapping and len(self._path) > 0:
            self._polished = polish(self._settings.polish, self._settings.map, self.submaps.all, self._path)

    def submaps_at(self, stamps: FloatArray) -> list[int]:
        """The submap in which the robot was at each of the scans' stamps (N,)."""
        rows = np.clip(np.searchsorted(self._path.stamps, stamps), 0, len(self._path) - 1)
        return [int(number) for number in self._path.submaps[rows]]

    def save(self, folder: Path) -> None:
        """Keep the session in a folder.

        Raises:
            SessionError: it cannot be written.
        """
        if self._settings.mapping:
            save_session(folder, self.submaps)

    def resume(self, folder: Path) -> bool:
        """Go on in the session that a folder holds; False where it holds none. To be called before the first frame.

        Raises:
            SessionError: it cannot be used.
        """
        submaps = load_session(folder, self._settings.map)
        if submaps is None or len(submaps) == 0:
            return False
        self._open(submaps)
        self.front.place(submaps[0].T_map_submap.inverse() @ self._start)
        self._unplaced = True
        return True

    def _open(self, submaps: Submaps) -> None:
        self.submaps = submaps
        self._chain = SubmapChain(self._settings.region, self._settings.map, submaps)
        self._closer = LoopCloser(self._settings.closing, submaps)

    def _register(self, scan: LaserScan) -> None:
        cloud = self.front.ego.points(scan)
        surfaces = self.submaps.use(self._chain.current).surfaces if len(self.submaps) else None
        pose = self.front.track(cloud, None if self._unplaced else surfaces)
        if self._unplaced:
            pose = self._find(cloud, pose)
        if len(self.submaps) == 0:
            pose = self._begin(scan.stamp)
        self._path.append(scan.stamp, self._chain.current, pose)
        if len(cloud.points) > 0 and not self._unplaced and self._settings.keyframes.passes(self._inserted, pose):
            self._keyframe(cloud, pose)

    def _begin(self, stamp: float) -> SE2:
        """The first submap lies where the robot starts."""
        pose = self.front.T_local_base
        self._chain.begin(stamp, self._start @ pose)
        self.front.rebase(pose.inverse())
        return SE2()

    def _find(self, cloud: PointScan, pose: SE2) -> SE2:
        """Look for the robot in the session's submaps; `pose` until it is found."""
        found = self._closer.anywhere(cloud, self._chain.here.T_map_submap @ pose)
        if found is None:
            return pose
        self._chain.enter(found.submap)
        self._unplaced = False
        self.front.place(found.T_submap_base)
        return found.T_submap_base

    def _keyframe(self, cloud: PointScan, pose: SE2) -> None:
        s = self._settings
        if s.mapping:
            self._frozen = None
            self._chain.insert(cloud, pose, self._inserted)
        self._inserted = pose
        if s.close_loops and (not s.region.covers(self._chain.here, pose) or s.attempts.passes(self._attempted, pose)):
            self._attempted = pose
            pose = self._recognise_others(cloud, pose)
        if s.mapping:
            drift = to_body(self.front.covariance, self.front.T_local_base), s.closing.slipping()
            T_new_current = self._chain.move_on(cloud, pose, drift)
            if T_new_current is not None:
                self._rebase(T_new_current)

    def _rebase(self, T_new_current: SE2) -> None:
        """Go on in the frame of another submap."""
        self.front.rebase(T_new_current)
        self._inserted = None if self._inserted is None else T_new_current @ self._inserted
        self._attempted = None if self._attempted is None else T_new_current @ self._attempted

    def _recognise_others(self, cloud: PointScan, pose: SE2) -> SE2:
        """Tie the current submap to others in which the scan is recognised; go over into an older one about the robot."""
        s, here = self._settings, Here(self._chain.current, pose, to_body(self.front.covariance, pose), cloud)
        for found in self._closer.around(here, s.region.radius):
            if s.mapping:
                self._closer.close(found, here)
                self._frozen = None
            inside = s.region.covers(self.submaps[found.submap], found.T_submap_base, 0.5 * s.region.overlap)
            left = not s.region.covers(self._chain.here, pose)
            older_or_left = found.submap < self._chain.current or left
            if inside and older_or_left and found.known > s.entry_known and (not s.mapping or self._closer.believes(found, here)):
                self._chain.enter(found.submap)
                self._rebase(found.T_submap_base @ pose.inverse())
                return found.T_submap_base
        return pose

    def _estimate(self, frame: SensorFrame) -> Estimate:
        if frame.scans or self.front.motion.newest != self._moved:  # a recording has many frames in which nothing moves
            self._moved = self.front.motion.newest
            self._place(frame.stamp)
        pose, T_map_odom, covariance = self._placed
        silent = self._watch.silent(frame)  # hears every frame
        reason = (FULL if self._chain.too_large else "") or self.front.trouble or silent
        if self._unplaced:
            reason = "the scan is not recognised in the session's map"
        status = Status.LOST if self.front.lost or self._unplaced else Status.DEGRADED if reason else Status.TRACKING
        return Estimate(frame.stamp, pose, T_map_odom, covariance, status, self.front.health, reason)

    def _place(self, stamp: float) -> None:
        """Pose in the map and its covariance: of the submap in the graph, and of the robot in the submap."""
        T_local_base, covariance = self.front.at(stamp)
        T_map_local = self._chain.here.T_map_submap if len(self.submaps) else self._start
        pose = T_map_local @ T_local_base
        body = to_body(covariance, T_local_base)
        if self._chain.current > 0:
            body = composed(self.submaps.relative(0)[self._chain.current], T_local_base, body)
        self._placed = (pose, pose @ self.front.motion.wheels.inverse(), from_body(body, pose))
