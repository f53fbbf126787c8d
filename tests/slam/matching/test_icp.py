import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from scripts.scan_pairs import DISPLACEMENT, displaced_room, recorded_pair
from slam.errors import ParameterError
from slam.mapping.grid_mapper import GridMapper, MapSettings
from slam.matching.gauss_newton import GaussNewton
from slam.matching.icp import Icp, align
from slam.se2 import SE2, FloatArray

poses = st.builds(SE2, st.floats(-10.0, 10.0), st.floats(-10.0, 10.0), st.floats(-math.pi, math.pi))
shapes = arrays(np.float64, (12, 2), elements=st.floats(-5.0, 5.0)).map(lambda points: points + [[8.0, 0.0], [0.0, 9.0]] * 6)
scans = st.integers(0, 6).flatmap(lambda n: arrays(np.float64, (n, 2), elements=st.floats(-100.0, 100.0) | st.just(math.nan)))
ALL_ROUND = np.linspace(-math.pi, math.pi, 720, endpoint=False)


def error(T: SE2, truth: SE2) -> float:
    """Largest component of the difference [m, rad]."""
    return float(np.abs((truth.inverse() @ T).as_array()).max())


def line(rng: np.random.Generator, angle: float, deviation: float = 0.01) -> FloatArray:
    """Seven noisy points (7, 2) [m] of a wall of 2 m, away from the origin."""
    along = np.linspace(2.0, 4.0, 7)[:, None] * [math.cos(angle), math.sin(angle)]
    return along + rng.normal(0.0, deviation, (7, 2))


def overlapping(room: Any, rng: np.random.Generator, truth: SE2) -> tuple[FloatArray, FloatArray]:
    """Source and target (M, 2) [m]: two noisy scans that share 65 % of what the source sees."""
    target = room.points(SE2(), rng.normal(0.0, 0.005, 720), ALL_ROUND)
    again = room.points(SE2(), rng.normal(0.0, 0.005, 720), ALL_ROUND)
    return truth.inverse().transform(again[:500]), target[175:]


def test_aligning_the_reports_points_gives_the_inverse_of_its_move():
    dst = np.random.default_rng(0).uniform(-3.0, 3.0, (20, 2))
    T = align(DISPLACEMENT.transform(dst), dst)
    np.testing.assert_allclose([T.x, T.y, math.degrees(T.yaw)], [-1.8660254, -1.2320508, -30.0], atol=1e-6)


@given(shapes, poses)
def test_any_rigid_motion_is_found_and_its_inverse_too(points, T):
    assert error(align(points, T.transform(points)), T) < 1e-9
    assert error(align(T.transform(points), points), T.inverse()) < 1e-9


def test_the_reports_check_comes_out_step_by_step():
    pair = displaced_room()
    steps = list(Icp(trim=1.0).steps(pair.source, pair.target, SE2()))
    assert len(steps) > 20
    assert error(steps[1].T_target_source, DISPLACEMENT.inverse()) > 0.3
    np.testing.assert_allclose(steps[-1].T_target_source.as_array(), [-1.8660254, -1.2320508, -math.pi / 6.0], atol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_the_reports_check_comes_out_of_moves_like_it_too(seed):
    dx, dy, turn = np.random.default_rng(seed).uniform([-0.3, -0.3, -0.1], [0.3, 0.3, 0.1])
    move, scan = DISPLACEMENT @ SE2(dx, dy, turn), displaced_room().target
    assert error(Icp(trim=1.0).match(move.transform(scan), scan, SE2()).T_target_source, move.inverse()) < 1e-6


@given(poses)
def test_one_step_is_enough_where_the_correspondences_are_right(truth):
    target = np.stack(np.meshgrid(np.arange(5.0), np.arange(3.0)), axis=-1).reshape(-1, 2)
    _, step, *_ = Icp(trim=1.0).steps(truth.inverse().transform(target), target, SE2(0.1, -0.05, 0.04) @ truth)
    assert error(step.T_target_source, truth) < 1e-9


@pytest.mark.parametrize("truth", [SE2(0.1, 0.0, 0.0), SE2(-0.1, 0.15, 0.1), SE2(0.2, 0.1, -0.15), SE2(0.0, 0.0, 0.2)])
def test_scans_from_two_places_are_laid_over_each_other_both_ways(truth, room):
    rng = np.random.default_rng(4)
    target, source = room.points(SE2(), rng.normal(0.0, 0.01, 682)), room.points(truth, rng.normal(0.0, 0.01, 682))
    assert error(Icp().match(source, target, SE2()).T_target_source, truth) < 0.03
    assert error(Icp().match(target, source, SE2()).T_target_source, truth.inverse()) < 0.03


def test_a_partial_overlap_of_65_percent_is_enough(room):
    truth = SE2(0.1, -0.05, 0.08)
    for seed in range(5):
        source, target = overlapping(room, np.random.default_rng(seed), truth)
        match = Icp().match(source, target, SE2())
        off = truth.inverse() @ match.T_target_source
        assert math.hypot(off.x, off.y) < 0.02
        assert abs(off.yaw) < math.radians(1.0)


def test_points_without_a_counterpart_do_not_move_the_answer():
    rng = np.random.default_rng(1)
    target = rng.uniform(-2.0, 2.0, (40, 2))
    source = SE2(0.02, 0.01, 0.01).transform(target)
    alone, far = np.full((25, 2), 60.0), np.full((70, 2), -80.0)
    icp = Icp(max_distance=0.5)
    _, first, *_ = icp.steps(source, target, SE2())
    _, crowded, *_ = icp.steps(np.vstack([source, alone]), np.vstack([far, target]), SE2())
    assert error(first.T_target_source, crowded.T_target_source) < 1e-12


def test_near_collinear_points_are_turned_and_never_reflected():
    tempted = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        p, q = line(rng, 0.7), line(rng, 1.0)
        U, _, V_h = np.linalg.svd((q - q.mean(axis=0)).T @ (p - p.mean(axis=0)))
        tempted += np.linalg.det(U @ V_h) < 0.0
        assert error(align(p, q), SE2(yaw=0.3)) < 0.15
    assert tempted > 10


def test_a_target_point_is_the_counterpart_of_one_source_point_only():
    source, target = np.array([[0.1, 0.0], [0.0, 0.0], [2.0, 0.1], [5.0, 5.0]]), np.array([[0.0, 0.0], [2.0, 0.0], [5.0, 5.2]])
    step = next(Icp(trim=1.0).steps(source, target, SE2()))
    np.testing.assert_allclose(step.p, [[0.0, 0.0], [2.0, 0.1], [5.0, 5.0]])
    np.testing.assert_allclose(step.q, target)


def test_trimming_drops_the_longest_correspondences():
    target = np.column_stack([np.arange(10.0), np.zeros(10)])
    source = target + np.column_stack([np.zeros(10), 0.01 * np.arange(10)])
    step = next(Icp(trim=0.65).steps(source, target, SE2()))
    np.testing.assert_allclose(step.p, source[:7])


def test_longer_correspondences_than_allowed_are_not_made():
    target = np.column_stack([np.arange(10.0), np.zeros(10)])
    source = target + np.column_stack([np.zeros(10), 0.04 * np.arange(10)])
    assert len(next(Icp(trim=1.0, max_distance=0.1).steps(source, target, SE2())).p) == 3


@pytest.mark.parametrize(
    ("source", "target"),
    [
        (np.empty((0, 2)), np.ones((9, 2))),
        (np.eye(2), np.empty((0, 2))),
        (np.eye(2), np.eye(2)),
        (np.full((9, 2), np.nan), np.arange(18.0).reshape(9, 2)),
        (np.arange(18.0).reshape(9, 2), np.full((9, 2), np.nan)),
        (np.zeros((9, 2)), np.arange(18.0).reshape(9, 2)),
        (np.arange(18.0).reshape(9, 2), np.arange(18.0).reshape(9, 2) + 500.0),
    ],
    ids=["no source", "no target", "two points", "source of nan", "target of nan", "points in one place", "nothing near"],
)
def test_too_few_points_leave_the_guess_and_say_so(source, target):
    guess = SE2(0.1, 0.2, 0.3)
    match = Icp(max_distance=20.0).match(source, target, guess)
    assert match.T_target_source == guess
    assert not match.converged
    assert np.isinf(np.diag(match.covariance)).all()


@given(scans, scans, poses, st.booleans())
def test_no_answer_holds_nan(source, target, guess, one_to_one):
    match = Icp(one_to_one=one_to_one).match(source, target, guess)
    assert np.isfinite(match.T_target_source.as_array()).all()
    assert not np.isnan(match.covariance).any()
    assert np.isfinite(match.rms)
    assert 0.0 <= match.inliers <= 1.0


def test_too_few_steps_are_not_convergence():
    pair = displaced_room()
    match = Icp(iterations=3, trim=1.0).match(pair.source, pair.target, SE2())
    assert not match.converged
    assert match.iterations == 3


def test_the_steps_go_from_the_guess_to_the_match(room):
    truth, guess = SE2(0.1, 0.05, 0.1), SE2(0.02, 0.0, 0.0)
    source, target = room.points(truth), room.points(SE2())
    steps, match = list(Icp().steps(source, target, guess)), Icp().match(source, target, guess)
    assert steps[0].T_target_source == guess
    assert steps[-1].T_target_source == match.T_target_source
    assert match.iterations == len(steps) - 1


def test_the_covariance_is_that_of_many_noisy_scans():
    rng = np.random.default_rng(2)
    truth, scan = SE2(1.0, -0.5, 0.4), np.stack(np.meshgrid(np.arange(6.0), np.arange(4.0)), axis=-1).reshape(-1, 2)
    seen = truth.inverse().transform(scan)
    squares = []
    for _ in range(1000):
        match = Icp(trim=1.0).match(seen + rng.normal(0.0, 0.02, seen.shape), scan + rng.normal(0.0, 0.02, scan.shape), truth)
        e = match.T_target_source.as_array() - truth.as_array()
        squares.append(e @ np.linalg.solve(match.covariance, e))
    assert np.mean(squares) == pytest.approx(3.0, rel=0.12)


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"iterations": 0}, r"Icp\.iterations = 0; must be above 0"),
        ({"tolerance": math.nan}, r"Icp\.tolerance = nan; must be above 0"),
        ({"trim": 1.5}, r"Icp\.trim = 1\.5; must be above 0 and at most 1"),
        ({"trim": 0.0}, r"Icp\.trim = 0\.0; must be above 0 and at most 1"),
        ({"max_distance": -1.0}, r"Icp\.max_distance = -1\.0; must be above 0"),
    ],
)
def test_an_impossible_parameter_is_refused(parameters, said):
    with pytest.raises(ParameterError, match=said):
        Icp(**parameters)


@pytest.mark.parametrize("first", [100, 220, 460, 520, 580, 640])
def test_real_scans_are_laid_where_scan_to_map_matching_lays_them(first, shared_data):
    pair = recorded_pair(shared_data / "urg04lx" / "exp1.dat", first, first + 3)
    match = Icp().match(pair.source, pair.target, pair.wheels)
    mapper = GridMapper(MapSettings())
    mapper.insert(SE2(), pair.target, np.zeros_like(pair.target))
    on_map = GaussNewton().match(mapper.field, pair.source, pair.wheels, np.diag([0.01, 0.01, 0.01]), 0.2)
    off = on_map.T_target_source.inverse() @ match.T_target_source
    assert match.converged
    assert math.hypot(off.x, off.y) < 0.025
    assert abs(off.yaw) < math.radians(1.0)


def test_real_scans_that_go_round_within_a_millimetre_have_converged(shared_data):
    pair = recorded_pair(shared_data / "urg04lx" / "exp1.dat", 40, 45)
    match = Icp().match(pair.source, pair.target, pair.wheels)
    assert match.converged
    assert match.iterations < 30


def test_real_scans_that_swing_by_centimetres_have_not_converged(shared_data):
    pair = recorded_pair(shared_data / "urg04lx" / "exp1.dat", 200, 210)
    assert not Icp().match(pair.source, pair.target, pair.wheels).converged
