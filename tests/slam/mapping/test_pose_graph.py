import math
from pathlib import Path

import numpy as np
import pytest

from slam.errors import PoseGraphError
from slam.evaluation.trajectory import align_points
from slam.mapping.chordal import chordal_poses
from slam.mapping.g2o_file import G2oGraph, read_g2o
from slam.mapping.least_squares import LeastSquares
from slam.mapping.pose_edges import Edges
from slam.mapping.pose_graph import PoseGraph
from slam.se2 import SE2, FloatArray

STEP = np.array([0.02, 0.01, 0.01])
"""Standard deviations of a step of odometry and of a closure."""
INFORMATION = np.diag(1.0 / STEP**2)


def _round(laps: int) -> list[SE2]:
    """A rectangle of 8 m x 4 m, driven in steps of 0.5 m."""
    poses, pose = list[SE2](), SE2(1.0, -2.0, 0.3)
    for steps in (16, 8, 16, 8) * laps:
        for _ in range(steps):
            poses.append(pose)
            pose = pose @ SE2(0.5)
        pose = pose @ SE2(yaw=0.5 * math.pi)
    return poses


def _drive(truth: list[SE2], rng: np.random.Generator) -> PoseGraph:
    """A graph of odometry alone."""
    graph = PoseGraph()
    graph.add_node(truth[0])
    for k in range(1, len(truth)):
        step = _measured(truth, k - 1, k, rng)
        graph.add_node(SE2.from_array(graph.poses[-1]) @ step)
        graph.add_edge(k - 1, k, step, INFORMATION, closure=False)
    return graph


def _measured(truth: list[SE2], i: int, j: int, rng: np.random.Generator) -> SE2:
    return truth[i].inverse() @ truth[j] @ SE2.exp(rng.normal(0.0, STEP))


def _error(graph: PoseGraph, truth: list[SE2]) -> float:
    """Largest position error [m]."""
    return float(np.max(np.hypot(*(graph.poses - [pose.as_array() for pose in truth]).T[:2])))


def test_true_closures_take_the_drift_out() -> None:
    truth, rng = _round(2), np.random.default_rng(1)
    graph = _drive(truth, rng)
    drift = _error(graph, truth)
    for k in range(0, 48, 4):
        graph.add_edge(k, k + 48, _measured(truth, k, k + 48, rng), INFORMATION, closure=True)
    graph.optimise()
    assert graph.rejected == set()
    assert _error(graph, truth) < 0.5 * drift
    assert graph.chi2 < 3 * 12 + 3 * math.sqrt(6 * 12)


@pytest.mark.parametrize("seed", range(4))
def test_false_closures_change_next_to_nothing(seed: int) -> None:
    truth, rng = _round(2), np.random.default_rng(seed)
    graph = _drive(truth, rng)
    for k in range(0, 48, 4):
        graph.add_edge(k, k + 48, _measured(truth, k, k + 48, rng), INFORMATION, closure=True)
    clean = graph.optimise()
    assert graph.rejected == set()
    false = set[int]()
    for i, j in rng.integers(0, len(truth), (40, 2)).tolist():
        if abs(i - j) > 4:
            T_i_j = SE2(rng.uniform(-8, 8), rng.uniform(-8, 8), rng.uniform(-math.pi, math.pi))
            false.add(graph.add_edge(i, j, T_i_j, INFORMATION, closure=True))
    poses = graph.optimise()
    assert graph.rejected == false
    assert np.allclose(poses, clean, atol=1e-6)


def test_false_closures_that_came_first_are_found_out() -> None:
    truth, rng = _round(2), np.random.default_rng(3)
    graph = _drive(truth, rng)
    false = {graph.add_edge(k, k + 48, truth[k].inverse() @ truth[k + 48] @ SE2(0.7, 0.5, 0.1), INFORMATION, closure=True) for k in (2, 3)}
    graph.optimise()
    for k in range(0, 48, 3):
        graph.add_edge(k, k + 48, _measured(truth, k, k + 48, rng), INFORMATION, closure=True)
    graph.optimise()
    assert graph.rejected == false


def test_a_lone_closure_of_a_long_loop_waits_for_others_that_agree() -> None:
    truth, rng = _round(10), np.random.default_rng(5)
    graph = _drive(truth, rng)
    last = len(truth) - 1
    lone = graph.add_edge(0, last - 47, _measured(truth, 0, last - 47, rng), INFORMATION, closure=True)
    drifted = graph.poses
    assert np.allclose(graph.optimise(), drifted, atol=1e-6)
    assert graph.rejected == {lone}
    for k in range(1, 6):
        graph.add_edge(k, last - 47 + k, _measured(truth, k, last - 47 + k, rng), INFORMATION, closure=True)
    graph.optimise()
    assert graph.rejected == set()


def test_an_axis_without_information_is_left_to_the_others() -> None:
    truth, rng = _round(1), np.random.default_rng(2)
    graph = _drive(truth, rng)
    graph.add_edge(0, 5, truth[0].inverse() @ truth[5] @ SE2(3.0), np.diag([0.0, 1e4, 1e4]), closure=False)
    graph.optimise()
    assert _error(graph, truth) < 1.0


def test_information_is_in_the_frame_of_the_newer_node() -> None:
    graph = PoseGraph()
    graph.add_node(SE2())
    graph.add_node(SE2(1.0, 0.0, 0.5 * math.pi))
    known_sideways = np.diag([1.0, 100.0, 1e4])
    graph.add_edge(0, 1, SE2(1.0, 0.0, 0.5 * math.pi), known_sideways, closure=False)
    graph.add_edge(0, 1, SE2(2.0, 1.0, 0.5 * math.pi), np.eye(3), closure=False)
    x, y, _ = graph.optimise()[1]
    assert x == pytest.approx(1.0 + 1.0 / 101.0, abs=1e-4)  # sideways of node 1 is along x
    assert y == pytest.approx(0.5, abs=1e-4)


def test_relative_covariance_of_odometry_is_what_its_steps_add_up_to() -> None:
    graph = PoseGraph()
    graph.add_node(SE2())
    for k in range(4):
        graph.add_node(SE2(k + 1.0))
        graph.add_edge(k, k + 1, SE2(1.0), np.diag([1e2, 1e4, 1e4]), closure=False)
    covariance, back = graph.relative_covariances(np.array([[1, 4], [4, 1]]))
    assert covariance[0, 0] == pytest.approx(3 * 1e-2, rel=1e-3)
    assert covariance[2, 2] == pytest.approx(3 * 1e-4, rel=1e-3)
    assert covariance[1, 1] == pytest.approx(3 * 1e-4 + 1e-4 * (2.0**2 + 1.0**2), rel=1e-3)
    assert back[0, 0] == pytest.approx(3 * 1e-2, rel=1e-3)
    assert back[1, 1] == pytest.approx(3 * 1e-4 + 1e-4 * (3.0**2 + 2.0**2 + 1.0**2), rel=1e-3)


def test_the_same_graph_gives_the_same_bits() -> None:
    def poses() -> FloatArray:
        truth, rng = _round(2), np.random.default_rng(1)
        graph = _drive(truth, rng)
        for k in range(0, 48, 4):
            graph.add_edge(k, (7 * k + 30) % 96, _measured(truth, k, k + 48, rng), INFORMATION, closure=True)
            graph.add_edge(k, k + 48, _measured(truth, k, k + 48, rng), INFORMATION, closure=True)
        return graph.optimise()

    assert poses().tobytes() == poses().tobytes()


def test_an_empty_graph_and_a_single_node_are_their_own_optimum() -> None:
    graph = PoseGraph()
    assert graph.optimise().shape == (0, 3)
    graph.add_node(SE2(1.0, 2.0, 3.0))
    assert graph.optimise().tolist() == [[1.0, 2.0, 3.0]]


def test_names_what_does_not_fit() -> None:
    graph = PoseGraph()
    graph.add_node(SE2())
    graph.add_node(SE2(1.0))
    with pytest.raises(PoseGraphError, match="from node 0 to node 2; must join two of the nodes 0 to 1"):
        graph.add_edge(0, 2, SE2(), INFORMATION, closure=True)
    with pytest.raises(PoseGraphError, match="not negative"):
        graph.add_edge(0, 1, SE2(), -INFORMATION, closure=True)
    with pytest.raises(PoseGraphError, match="must be finite"):
        graph.add_edge(0, 1, SE2(math.nan), INFORMATION, closure=True)
    graph.add_edge(0, 1, SE2(1.0), INFORMATION, closure=True)
    with pytest.raises(PoseGraphError, match="node 1 is not connected to node 0"):
        graph.optimise()


def test_intel_has_the_published_optimum(shared_data: Path) -> None:
    graph = read_g2o(shared_data / "posegraphs" / "intel.g2o")
    poses = LeastSquares(len(graph.poses), graph.edges).optimise(graph.poses)
    assert graph.edges.chi2(poses).sum() == pytest.approx(45.0047, abs=1e-4)


@pytest.fixture(scope="module")
def manhattan(shared_data: Path) -> tuple[G2oGraph, FloatArray]:
    graph = read_g2o(shared_data / "posegraphs" / "manhattan.g2o")
    return graph, LeastSquares(len(graph.poses), graph.edges).optimise(graph.poses)


def test_manhattan_has_the_published_optimum_from_its_edges_alone(manhattan: tuple[G2oGraph, FloatArray]) -> None:
    graph, poses = manhattan
    assert graph.edges.chi2(poses).sum() == pytest.approx(3549.04, abs=0.01)


def test_a_bad_guess_ends_at_the_optimum_too(manhattan: tuple[G2oGraph, FloatArray]) -> None:
    graph, _ = manhattan
    poses = LeastSquares(len(graph.poses), graph.edges).optimise(np.zeros_like(graph.poses))
    assert graph.edges.chi2(poses).sum() == pytest.approx(3549.04, abs=0.01)


def test_as_many_false_loops_as_true_ones_move_manhattan_by_centimetres(manhattan: tuple[G2oGraph, FloatArray]) -> None:
    whole, clean = manhattan
    rng = np.random.default_rng(11)
    step = whole.edges.nodes[:, 1] - whole.edges.nodes[:, 0] == 1
    odometry, true = whole.edges.of(step), whole.edges.of(~step)
    pairs = rng.integers(0, len(clean), (len(true), 2))
    offset = np.column_stack([rng.uniform(-50, 50, (len(true), 2)), rng.uniform(-math.pi, math.pi, len(true))])
    graph = PoseGraph()
    for pose in chordal_poses(len(clean), odometry):
        graph.add_node(SE2.from_array(pose))
    _add(graph, odometry, closure=False)
    _add(graph, true.and_(Edges(np.sort(pairs, axis=1), offset, true.information)), closure=True)
    poses = graph.optimise()
    R, t = align_points(poses[:, :2], clean[:, :2])
    assert np.sqrt(np.mean(np.sum((poses[:, :2] @ R.T + t - clean[:, :2]) ** 2, axis=1))) < 0.1


def _add(graph: PoseGraph, edges: Edges, closure: bool) -> None:
    for (i, j), measured, information in zip(edges.nodes.tolist(), edges.measured, edges.information, strict=True):
        if i != j:
            graph.add_edge(i, j, SE2.from_array(measured), information, closure)
