"""evo is the oracle."""

import math

import numpy as np
import pytest
from evo.core import metrics, sync
from evo.core.trajectory import PoseTrajectory3D
from evo.tools import file_interface
from hypothesis import given
from hypothesis import strategies as st

from slam.errors import TrajectoryError
from slam.evaluation.poses import transform
from slam.evaluation.trajectory import (
    Statistics,
    absolute_errors,
    align,
    align_points,
    associate,
    interpolate_truth,
    pairs_by_distance,
    pairs_by_frames,
    relative_errors,
)
from slam.messages import Trajectory
from slam.se2 import SE2, interpolate


def wandering(seed, count=80):
    rng = np.random.default_rng(seed)
    steps = rng.normal([0.08, 0.0, 0.05], [0.03, 0.02, 0.3], (count, 3))
    poses = [SE2()]
    for step in steps[1:]:
        poses.append(poses[-1] @ SE2.exp(step))
    return Trajectory(np.arange(count) * 0.1, [pose.as_array() for pose in poses])


def disturbed(truth, seed):
    noise = np.random.default_rng(seed).normal(0.0, [0.05, 0.05, 0.02], truth.poses.shape)
    return Trajectory(truth.stamps, transform(SE2(3.0, -2.0, 2.1), truth.poses + noise))


def to_evo(trajectory):
    x, y, yaw = trajectory.poses.T
    zero = np.zeros_like(x)
    quaternions = np.column_stack([np.cos(yaw / 2), zero, zero, np.sin(yaw / 2)])
    return PoseTrajectory3D(np.column_stack([x, y, zero]), quaternions, trajectory.stamps)


def assert_agree(ours, theirs):
    summary = theirs.get_all_statistics()
    assert np.allclose(ours, theirs.error, atol=1e-9, rtol=0.0)
    ours = Statistics.of(ours)
    for name in ("rmse", "mean", "median", "std", "max"):
        assert getattr(ours, name) == pytest.approx(summary[name], abs=1e-9)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_absolute_error_after_alignment_is_that_of_evo(seed):
    truth = wandering(seed)
    estimate = disturbed(truth, seed)
    errors = absolute_errors(truth, estimate, align(truth, estimate))
    reference, aligned = to_evo(truth), to_evo(estimate)
    aligned.align(reference)
    for values, relation in (
        (errors.translation, metrics.PoseRelation.translation_part),
        (errors.heading, metrics.PoseRelation.rotation_angle_rad),
    ):
        ape = metrics.APE(relation)
        ape.process_data((reference, aligned))
        assert_agree(values, ape)


@pytest.mark.parametrize(("unit", "delta"), [(metrics.Unit.frames, 1), (metrics.Unit.frames, 7), (metrics.Unit.meters, 0.5)])
def test_the_relative_error_is_that_of_evo(unit, delta):
    truth = wandering(5)
    estimate = disturbed(truth, 6)
    pairs = pairs_by_frames(len(truth), delta) if unit == metrics.Unit.frames else pairs_by_distance(truth, delta)
    errors = relative_errors(truth, estimate, pairs)
    for values, relation in (
        (errors.translation, metrics.PoseRelation.translation_part),
        (errors.heading, metrics.PoseRelation.rotation_angle_rad),
    ):
        rpe = metrics.RPE(relation, delta, unit, pairs_from_reference=True)
        rpe.process_data((to_evo(truth), to_evo(estimate)))
        assert_agree(values, rpe)


def test_the_public_example_of_evo_scores_the_published_error(shared_data):
    folder = shared_data / "trajectories"
    truth = file_interface.read_tum_trajectory_file(folder / "freiburg1_xyz-groundtruth.txt")
    estimate = file_interface.read_tum_trajectory_file(folder / "freiburg1_xyz-rgbdslam_drift.txt")
    truth, estimate = sync.associate_trajectories(truth, estimate, max_diff=0.01)
    R, t = align_points(estimate.positions_xyz, truth.positions_xyz)
    errors = np.linalg.norm(estimate.positions_xyz @ R.T + t - truth.positions_xyz, axis=1)
    assert Statistics.of(errors).rmse == pytest.approx(0.013470, abs=5e-7)


@pytest.mark.parametrize("shorter", ["truth", "estimate"])
def test_association_pairs_the_stamps_that_evo_pairs(shorter):
    rng = np.random.default_rng(4)
    dense, sparse = wandering(1, 200), wandering(1, 60)
    sparse = Trajectory(np.sort(rng.uniform(0.0, 20.0, 60)), sparse.poses)
    truth, estimate = (sparse, dense) if shorter == "truth" else (dense, sparse)
    expected = sync.associate_trajectories(to_evo(truth), to_evo(estimate), max_diff=0.02)
    paired = associate(truth, estimate, 0.02)
    assert [pair.stamps.tolist() for pair in paired] == [pair.timestamps.tolist() for pair in expected]


def test_truth_is_interpolated_along_the_arc():
    truth = Trajectory([0.0, 1.0], [(0.0, 0.0, 0.0), (1.0, 1.0, math.pi / 2)])
    paired, _ = interpolate_truth(truth, Trajectory([0.25], [(0.0, 0.0, 0.0)]), max_difference=0.5)
    expected = interpolate(SE2(), SE2(1.0, 1.0, math.pi / 2), 0.25)
    assert paired.poses[0] == pytest.approx(expected.as_array())


def test_truth_is_not_interpolated_across_a_gap():
    truth = Trajectory([0.0, 10.0], np.zeros((2, 3)))
    paired, kept = interpolate_truth(truth, Trajectory([0.01, 5.0, 9.99], np.zeros((3, 3))))
    assert kept.stamps.tolist() == paired.stamps.tolist() == [0.01, 9.99]


def test_trajectories_of_different_times_are_refused():
    early, late = Trajectory([0.0, 1.0], np.zeros((2, 3))), Trajectory([50.0], np.zeros((1, 3)))
    with pytest.raises(TrajectoryError, match=r"truth covers 0\.000\.\.1\.000 s, estimate 50\.000\.\.50\.000 s"):
        interpolate_truth(early, late)


def test_an_empty_trajectory_is_refused():
    with pytest.raises(TrajectoryError, match="estimate nothing"):
        associate(wandering(0), Trajectory([], []))


@given(st.floats(-10, 10), st.floats(-10, 10), st.floats(-3.1, 3.1))
def test_alignment_finds_any_transform(x, y, yaw):
    truth = wandering(2)
    estimate = Trajectory(truth.stamps, transform(SE2(x, y, yaw).inverse(), truth.poses))
    assert align(truth, estimate).as_array() == pytest.approx([x, y, yaw], abs=1e-9)


def test_a_robot_that_turned_on_the_spot_is_aligned_by_its_heading():
    turn = np.linspace(0.0, 6.0, 50)
    jitter = np.random.default_rng(0).normal(0.0, 1e-3, (50, 2))
    truth = Trajectory(turn, np.column_stack([np.ones(50), np.ones(50), turn]))
    estimate = Trajectory(turn, np.column_stack([jitter, turn - 0.7]))
    assert align(truth, estimate).yaw == pytest.approx(0.7)
    assert Statistics.of(absolute_errors(truth, estimate, align(truth, estimate)).heading).max < 1e-9
