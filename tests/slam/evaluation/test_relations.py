import math

import numpy as np
import pytest

from slam.errors import TrajectoryError
from slam.evaluation.poses import relative, sample
from slam.evaluation.relations import Relations, read_relations, relation_error
from slam.messages import Trajectory


def circling(stamps):
    return Trajectory(stamps, np.column_stack([np.sin(stamps), 1.0 - np.cos(stamps), stamps]))


DENSE = circling(np.linspace(0.0, 6.0, 601))
SCANS = circling(np.linspace(0.5, 5.5, 11))


def relations_between(trajectory, stamps):
    i, j = (sample(trajectory, column) for column in stamps.T)
    return Relations(stamps, relative(i, j))


def test_a_perfect_estimate_has_no_error_even_where_relations_end_between_scans():
    stamps = np.random.default_rng(0).uniform(0.0, 6.0, (200, 2))
    error = relation_error(SCANS, DENSE, relations_between(DENSE, stamps))
    assert error.count == 200
    assert error.translation_mean == pytest.approx(0.0, abs=1e-9)
    assert error.rotation_mean == pytest.approx(0.0, abs=1e-9)


def test_the_frame_of_the_odometry_does_not_matter():
    shifted = Trajectory(DENSE.stamps, np.column_stack([9.0 - DENSE.poses[:, 1], DENSE.poses[:, 0], DENSE.poses[:, 2] + math.pi / 2]))
    error = relation_error(SCANS, shifted, relations_between(DENSE, np.array([[0.6, 3.33], [1.27, 5.9]])))
    assert error.translation_mean == pytest.approx(0.0, abs=1e-9)


def test_both_scans_are_blended_linearly_in_time():
    still = Trajectory([0.0, 1.0], np.zeros((2, 3)))
    estimate = Trajectory([0.0, 1.0], [(0.0, 0.0, 0.0), (1.0, 0.0, 0.4)])
    error = relation_error(estimate, still, Relations(np.array([[0.0, 0.25]]), np.zeros((1, 3))))
    assert error.translation_mean == pytest.approx(0.25)
    assert error.rotation_mean == pytest.approx(0.1)


def test_beyond_the_scans_odometry_carries_on_from_the_nearest():
    odometry = Trajectory([0.0, 10.0], [(0.0, 0.0, 0.0), (10.0, 0.0, 0.0)])
    estimate = Trajectory([4.0, 5.0], [(4.0, 0.0, 0.0), (5.0, 0.0, 0.0)])
    error = relation_error(
        estimate, odometry, Relations(np.array([[1.0, 9.0], [-5.0, 20.0]]), np.array([(8.0, 0.0, 0.0), (10.0, 0.0, 0.0)]))
    )
    assert error.translation_mean == pytest.approx(0.0, abs=1e-12)


def test_errors_are_absolute_with_mean_and_spread():
    relations = Relations(np.array([[0.0, 1.0], [0.0, 1.0]]), np.array([(0.3, 0.4, 0.2), (0.0, 0.1, -0.4)]))
    still = Trajectory([0.0, 1.0], np.zeros((2, 3)))
    error = relation_error(still, still, relations)
    assert (error.translation_mean, error.translation_std) == pytest.approx((0.3, 0.2))
    assert (error.rotation_mean, error.rotation_std) == pytest.approx((0.3, 0.1))


def test_an_empty_estimate_is_refused():
    with pytest.raises(TrajectoryError, match="without poses"):
        relation_error(Trajectory([], []), DENSE, Relations(np.zeros((1, 2)), np.zeros((1, 3))))


def test_every_relation_of_the_intel_lab_is_at_a_stamp_of_the_log(shared_data):
    relations = read_relations(shared_data / "intel-lab" / "intel.relations")
    lines = (shared_data / "intel-lab" / "intel.log").read_text().splitlines()
    stamps = np.sort([float(line.rsplit(maxsplit=3)[1]) for line in lines if line.startswith(("ODOM", "FLASER"))])
    queries = relations.stamps.ravel()
    index = np.clip(np.searchsorted(stamps, queries), 1, len(stamps) - 1)
    assert len(relations.poses) == 2984
    assert np.minimum(np.abs(stamps[index] - queries), np.abs(stamps[index - 1] - queries)).max() < 1e-9


@pytest.mark.parametrize(
    ("text", "message"), [("", "holds no relation"), ("1 2 3\n", "line 1: '1 2 3' must be"), ("1 2 3 4 5 6 7 nan\n", "line 1")]
)
def test_a_file_that_holds_no_relations_is_refused(tmp_path, text, message):
    path = tmp_path / "wrong.relations"
    path.write_text(text)
    with pytest.raises(TrajectoryError, match=message):
        read_relations(path)
