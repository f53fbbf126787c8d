"""`twin bench correlative`: branch and bound over windows of poses, its speed and how often it finds the way from one scan to another."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable

import karto_scanmatcher as karto
import numpy as np

from hardware.spec import LidarSpec
from scripts.bench.row import Row
from scripts.bench.still_scans import StillPair, StillScans
from slam.mapping.grid_mapper import GridMapper, MapSettings
from slam.matching.branch_and_bound import BranchAndBound, Found, ScanTables
from slam.matching.gauss_newton import GaussNewton
from slam.matching.score_pyramid import ScorePyramid
from slam.se2 import SE2, FloatArray

GROUP = "correlative"
WORLDS = ("aruco_room", "office", "apartment")
APART, TURNED = (0.3, 0.7), (math.radians(10.0), math.radians(25.0))
BOUND = 0.020
"""Largest Cramér-Rao bound of a pair that counts [m]."""
PRIOR = np.diag([0.05**2, 0.05**2, 0.02**2])
"""Covariance that the refinement believes of the search's answer: two steps of its lattice."""
RIGHT = (0.1, 0.03)
"""Errors below which an answer is right [m], [rad]."""
STEP = math.radians(0.5)
WINDOWS = ((0.5, 20.0, 1.0, 8.4), (4.0, 90.0, 10.0, 86.0))
"""Full widths [m], [deg]; what is asked for, what Olson (2009) needs [ms]."""
SIGMA = (0.010, 0.01)
"""Datasheet noise of a range [m], and its share of the range where that is more."""
LASER = np.array([0.03, 0.0])
"""Where the laser is in base [m]."""


def run(smoke: bool) -> list[Row]:
    """Rows of speed and success."""
    return [*_speed_rows(4 if smoke else 60), _submap_row(3 if smoke else 20), *_success_rows(6 if smoke else 400)]


def pyramid_of(points: FloatArray) -> ScorePyramid:
    """Score tables of a scan (N, 2) [m] of the robot's laser."""
    return ScorePyramid.of_scan(points, np.broadcast_to(LASER, points.shape))


def tables_of(points: FloatArray) -> ScanTables:
    """Score tables and points (N, 2) [m] of a scan."""
    return pyramid_of(points), points


def cramer_rao(ideal: StillPair) -> float:
    """Least standard deviation of the position along its weakest axis [m], for scans without noise (M, 2) of which all is known.

    Censi, "On achievable accuracy for range-finder localization" (2007): the information of one beam is g g^T / sigma^2 with
    g = (n, n x p) / cos(incidence). Here only the source's beams count whose hits the target's see, with the noise of both.
    """
    points = ideal.source
    ranges = np.hypot(*(points - LASER).T)
    back, ahead = np.roll(points, 1, axis=0) - points, np.roll(points, -1, axis=0) - points
    along = ahead - back
    normals = np.column_stack([-along[:, 1], along[:, 0]]) / np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9)[:, None]
    flat = np.maximum(np.abs(np.sum(normals * back, axis=1)), np.abs(np.sum(normals * ahead, axis=1))) < 0.003
    cosines = np.abs(np.sum(normals * (points - LASER), axis=1)) / ranges
    seen = (
        _seen(ideal.T_target_source.transform(points), ideal.target) & flat & (np.hypot(along[:, 0], along[:, 1]) < 0.3) & (cosines > 0.05)
    )
    lever = normals[:, 1] * points[:, 0] - normals[:, 0] * points[:, 1]
    g = np.column_stack([normals, lever]) / cosines[:, None]
    sigma = np.maximum(SIGMA[0], SIGMA[1] * ranges) * math.sqrt(2.0)
    information = (g[seen] / sigma[seen, None] ** 2).T @ g[seen]
    if np.linalg.matrix_rank(information) < 3:
        return math.inf
    return math.sqrt(float(np.linalg.eigvalsh(np.linalg.inv(information)[:2, :2])[-1]))


def _seen(points: FloatArray, target: FloatArray) -> np.ndarray:
    """Which points (M, 2) lie within 5 cm of where the target's beams (N, 2) in their direction end, (M,)."""
    bearings = np.arctan2(*(target - LASER).T[::-1])
    order = np.argsort(bearings)
    ranges = np.hypot(*(target - LASER).T)[order]
    wanted = np.arctan2(*(points - LASER).T[::-1])
    nearest = np.clip(np.searchsorted(bearings[order], wanted), 0, len(order) - 1)
    close = np.abs(bearings[order][nearest] - wanted) < math.radians(1.5)
    return close & (np.abs(ranges[nearest] - np.hypot(*(points - LASER).T)) < 0.05)


def _pairs(world: str, count: int) -> list[StillPair]:
    """Pairs with datasheet noise of which the Cramér-Rao bound is small enough."""
    noisy, ideal = StillScans(world), StillScans(world, "ideal")
    bare = ideal.lidar(np.random.default_rng(0))
    pairs = (
        pair
        for pair in noisy.pairs(11, APART, TURNED)
        if cramer_rao(
            StillPair(
                ideal.points(bare, pair.T_world_target @ pair.T_target_source),
                ideal.points(bare, pair.T_world_target),
                pair.T_target_source,
                pair.T_world_target,
            )
        )
        <= BOUND
    )
    return list(itertools.islice(pairs, count))


def _success_rows(count: int) -> list[Row]:
    """Share of pairs that the search from a zero guess and the refinement after it get right."""
    rows: list[Row] = []
    matcher, search = GaussNewton(), BranchAndBound(reach=1.0, turn=math.radians(35.0))
    for world in WORLDS:
        rights = [_right(pair, search, matcher) for pair in _pairs(world, count)]
        name = f"`correlative` + `gauss_newton` from a zero guess, `{world}`, {len(rights)} pairs"
        rows.append(Row(GROUP, name, 100.0 * float(np.mean(rights)), "%", "≥ 99", "PL-ICP, published, on Intel", 66.0))
    return rows


def _right(pair: StillPair, search: BranchAndBound, matcher: GaussNewton) -> bool:
    found = search.search_pair(tables_of(pair.target), tables_of(pair.source), SE2())
    if found is None:
        return False
    off = pair.T_target_source.inverse() @ refined(pair, found, matcher)
    return math.hypot(off.x, off.y) < RIGHT[0] and abs(off.yaw) < RIGHT[1]


def refined(pair: StillPair, found: Found, matcher: GaussNewton) -> SE2:
    """The pose after Gauss-Newton on the target's surfaces."""
    mapper = GridMapper(MapSettings())
    mapper.insert(SE2(), pair.target, np.broadcast_to(LASER, pair.target.shape))
    return matcher.match(mapper.field, pair.source, found.T_map_base, PRIOR, 0.1).T_target_source


def _speed_rows(count: int) -> list[Row]:
    """Median time of searches about where odometry would expect the scan, and of Karto's matcher over the same windows."""
    noisy = StillScans("office")
    pairs = list(itertools.islice(noisy.pairs(3, APART, TURNED), count))
    built = _median([lambda p=pair: pyramid_of(p.target) for pair in pairs])
    rng = np.random.default_rng(0)
    rows = [Row(GROUP, "score tables of a scan", 1e3 * built, "ms")]
    for width, angle, asked, olson in WINDOWS:
        turn = math.radians(0.5 * angle)
        matcher = BranchAndBound(0.5 * width, turn, STEP)
        shifts = rng.uniform(-0.4, 0.4, (count, 3)) * [width, width, 2.0 * turn]
        searches = [
            (pyramid_of(pair.target), pair.source, SE2.from_array(pair.T_target_source.as_array() + shift))
            for pair, shift in zip(pairs, shifts, strict=True)
        ]
        ours = _median([lambda s=s, m=matcher: m.search(*s) for s in searches])
        peer = _median([_karto(noisy, pair, (width, turn)) for pair in pairs[: max(3, count // 10)]])
        name = f"window of {width:g} m, {angle:g} deg, lattice 2.5 cm, 0.5 deg, 682 beams (Olson: {olson:g} ms)"
        rows.append(
            Row(
                GROUP,
                name,
                1e3 * ours,
                "ms",
                f"≤ {asked:g}",
                "karto-scanmatcher; ratio with our tables",
                1e3 * peer,
                peer / (ours + built),
            )
        )
    return rows


def _submap_row(count: int) -> Row:
    """Score tables of a map of 12 x 12 m."""
    noisy, mapper = StillScans("office"), GridMapper(MapSettings(fixed_size=12.0))
    pair = next(noisy.pairs(3, APART, TURNED))
    for yaw in range(-3, 4):
        pose = pair.T_world_target @ SE2(0.0, 0.0, yaw)
        points = noisy.points(noisy.lidar(np.random.default_rng(yaw + 3)), pose)
        mapper.insert(SE2(0.0, 0.0, pose.yaw), points, np.broadcast_to(LASER, points.shape))
    return Row(GROUP, "score tables of a 12 x 12 m map", 1e3 * _median([lambda: ScorePyramid.of(mapper.grid)] * count), "ms")


def _median(works: list[Callable[[], object]]) -> float:
    """Median over the works of the process's time, the best of three [s], after one warm-up."""
    works[0]()
    return float(np.median([min(_seconds(work) for _ in range(3)) for work in works]))


def _seconds(work: Callable[[], object]) -> float:
    began = time.process_time()
    work()
    return time.process_time() - began


def _karto(scans: StillScans, pair: StillPair, window: tuple[float, float]) -> Callable[[], object]:
    """Karto's coarse search of one scan in another over the same window and lattice."""
    config = karto.ScanMatcherConfig()
    config.search_size, config.resolution = window[0], 0.025
    config.coarse_search_angle_offset, config.coarse_angle_resolution = window[1], STEP
    spec = LidarSpec()
    laser = karto.LaserScanConfig(
        spec.angles[0], spec.angles[-1], spec.angle_increment, spec.range_min, spec.range_max, spec.range_max, "laser"
    )
    rng = np.random.default_rng(0)
    poses = (pair.T_world_target, pair.T_world_target @ pair.T_target_source)
    both = [_karto_scan(laser, scans, pose, rng, number) for number, pose in enumerate(poses)]
    matcher = karto.Wrapper(config)
    return lambda: matcher.match_scan(both[1], [both[0]], True, False)


def _karto_scan(laser: object, scans: StillScans, pose: SE2, rng: np.random.Generator, number: int) -> object:
    points = scans.points(scans.lidar(rng), pose) - LASER
    ranges = np.full(LidarSpec().beams, 5.6)
    beams = np.rint((np.arctan2(points[:, 1], points[:, 0]) - LidarSpec().angles[0]) / LidarSpec().angle_increment).astype(int)
    ranges[np.clip(beams, 0, len(ranges) - 1)] = np.hypot(points[:, 0], points[:, 1])
    return karto.LocalizedRangeScan(
        laser, ranges.tolist(), karto.Pose2(*pose.as_array()), karto.Pose2(*pose.as_array()), number, float(number)
    )
