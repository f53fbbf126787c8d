"""`twin bench posegraph`: public pose graphs, whole and with false loop closures, side by side with gtsam."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from pathlib import Path

import gtsam
import numpy as np

from scripts.bench.row import Row, median_time
from scripts.errors import UsageError
from slam.evaluation.trajectory import align_points
from slam.mapping.chordal import chordal_poses
from slam.mapping.g2o_file import G2oGraph, read_g2o
from slam.mapping.least_squares import LeastSquares
from slam.mapping.pose_edges import Edges
from slam.mapping.pose_graph import PoseGraph
from slam.se2 import SE2, FloatArray

SMALL = 400
"""Nodes of the graph on which gtsam's GNC ends in seconds: the first of `intel.g2o`."""


def run(smoke: bool) -> list[Row]:
    """Optimum, time, and what false closures do.

    Raises:
        UsageError: the graphs are not there.
    """
    data = Path(os.environ.get("BRICKTWIN_DATA", Path(__file__).parents[3] / "shared" / "data")) / "posegraphs"
    if not data.is_dir():
        raise UsageError(f"no pose graphs at {data}; set BRICKTWIN_DATA to the folder that holds posegraphs/")
    intel, manhattan = (read_g2o(data / name) for name in ("intel.g2o", "manhattan.g2o"))
    repeats = 1 if smoke else 9
    return [
        *_optimum("intel.g2o", intel, False, repeats),
        *_optimum("manhattan.g2o from its edges alone", manhattan, True, repeats),
        *_false_loops("manhattan.g2o", manhattan, (1,) if smoke else (1, 2, 3, 4, 5)),
        *_against_gnc(_first(intel, SMALL)),
    ]


def _optimum(name: str, graph: G2oGraph, alone: bool, repeats: int) -> list[Row]:
    """Plain least squares with every edge; `alone` counts finding the first guess, which gtsam is given."""
    count, edges = len(graph.poses), graph.edges

    def ours() -> FloatArray:
        return LeastSquares(count, edges).optimise(chordal_poses(count, edges) if alone else graph.poses)

    factors, values = _gtsam(graph)

    def theirs() -> gtsam.Values:
        return gtsam.LevenbergMarquardtOptimizer(factors, values, gtsam.LevenbergMarquardtParams()).optimize()

    chi2, time_ours, time_theirs = float(edges.chi2(ours()).sum()), median_time(ours, repeats), median_time(theirs, repeats)
    asked, limit = ("3549.04", "≤ 1000") if alone else ("45.0047", "≤ 100")
    return [
        Row("posegraph", f"{name}, chi2", chi2, "", f"{asked} to 4 digits", "gtsam", 2.0 * factors.error(theirs())),
        Row("posegraph", f"{name}, time", 1e3 * time_ours, "ms", limit, "gtsam LM", 1e3 * time_theirs, time_theirs / time_ours),
    ]


def _false_loops(name: str, graph: G2oGraph, seeds: tuple[int, ...]) -> list[Row]:
    """As many uniform random false closures as true ones; the worst of the seeds."""
    clean = LeastSquares(len(graph.poses), graph.edges).optimise(graph.poses)
    found = [_robust(Spoilt.of(graph, clean, seed), clean) for seed in seeds]
    rmse, seconds = np.max(found, axis=0)
    title = f"{name} + as many false loops, worst of {len(seeds)} seeds"
    return [
        Row("posegraph", f"{title}, RMSE to the clean optimum", float(rmse), "m", "≤ 0.1"),
        Row("posegraph", f"{title}, time", float(seconds), "s", "≤ 30"),
    ]


def _against_gnc(graph: G2oGraph) -> list[Row]:
    clean = LeastSquares(len(graph.poses), graph.edges).optimise(graph.poses)
    spoilt = Spoilt.of(graph, clean, 1)
    rmse, seconds = _robust(spoilt, clean)
    peer, peer_seconds = _gnc(spoilt, clean)
    title = f"intel.g2o, first {len(graph.poses)} nodes + as many false loops"
    return [
        Row("posegraph", f"{title}, RMSE", rmse, "m", "", "gtsam GNC-TLS", peer),
        Row("posegraph", f"{title}, time", seconds, "s", "", "gtsam GNC-TLS", peer_seconds, peer_seconds / seconds),
    ]


@dataclass(frozen=True)
class Spoilt:
    """A graph with false closures; its first guess is the odometry's."""

    poses: FloatArray
    odometry: Edges
    closures: Edges

    @classmethod
    def of(cls, graph: G2oGraph, clean: FloatArray, seed: int) -> Spoilt:
        """False closures between any two nodes, anywhere within the map's extent, as sure of themselves as true ones."""
        rng = np.random.default_rng(seed)
        step = graph.edges.nodes[:, 1] - graph.edges.nodes[:, 0] == 1
        odometry, true = graph.edges.of(step), graph.edges.of(~step)
        pairs = np.sort(rng.integers(0, len(clean), (4 * len(true), 2)), axis=1)
        pairs = pairs[pairs[:, 1] - pairs[:, 0] > 1][: len(true)]
        offset = rng.uniform(-1.0, 1.0, (len(true), 2)) * np.ptp(clean[:, :2], axis=0)
        heading = rng.uniform(-np.pi, np.pi, len(true))
        information = true.information[rng.integers(0, len(true), len(true))]
        closures = true.and_(Edges(pairs, np.column_stack([offset, heading]), information))
        return cls(chordal_poses(len(clean), odometry), odometry, closures)


def _robust(spoilt: Spoilt, clean: FloatArray) -> tuple[float, float]:
    """RMSE to the clean optimum [m] and time [s] of our graph."""
    graph = PoseGraph()
    for pose in spoilt.poses:
        graph.add_node(SE2.from_array(pose))
    for edges, closure in ((spoilt.odometry, False), (spoilt.closures, True)):
        for (i, j), measured, information in zip(edges.nodes.tolist(), edges.measured, edges.information, strict=True):
            graph.add_edge(i, j, SE2.from_array(measured), information, closure)
    began = time.perf_counter()
    poses = graph.optimise()
    return _rmse(poses, clean), time.perf_counter() - began


def _gnc(spoilt: Spoilt, clean: FloatArray) -> tuple[float, float]:
    """RMSE to the clean optimum [m] and time [s] of gtsam's graduated non-convexity, odometry known to be true."""
    factors, values = _gtsam(G2oGraph(spoilt.poses, spoilt.odometry.and_(spoilt.closures)))
    params = gtsam.GncLMParams(gtsam.LevenbergMarquardtParams())
    params.setLossType(gtsam.GncLossType.TLS)
    params.setKnownInliers([*range(len(spoilt.odometry)), factors.size() - 1])
    began = time.perf_counter()
    result = gtsam.GncLMOptimizer(factors, values, params).optimize()
    seconds = time.perf_counter() - began
    poses = np.array([[result.atPose2(k).x(), result.atPose2(k).y()] for k in range(len(clean))])
    return _rmse(poses, clean), seconds


def _gtsam(graph: G2oGraph) -> tuple[gtsam.NonlinearFactorGraph, gtsam.Values]:
    """The graph as gtsam's, node 0 held where it is."""
    factors, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for k, pose in enumerate(graph.poses):
        values.insert(k, gtsam.Pose2(*pose))
    edges = graph.edges
    for (i, j), measured, information in zip(edges.nodes.tolist(), edges.measured, edges.information, strict=True):
        factors.add(gtsam.BetweenFactorPose2(i, j, gtsam.Pose2(*measured), gtsam.noiseModel.Gaussian.Information(information)))
    factors.add(gtsam.PriorFactorPose2(0, values.atPose2(0), gtsam.noiseModel.Isotropic.Sigma(3, 1e-3)))
    return factors, values


def _first(graph: G2oGraph, count: int) -> G2oGraph:
    return G2oGraph(graph.poses[:count], graph.edges.of(np.all(graph.edges.nodes < count, axis=1)))


def _rmse(poses: FloatArray, clean: FloatArray) -> float:
    """Of the positions, after the best rotation and translation [m]."""
    R, t = align_points(poses[:, :2], clean[:, :2])
    return float(np.sqrt(np.mean(np.sum((poses[:, :2] @ R.T + t - clean[:, :2]) ** 2, axis=1))))
