import csv

import numpy as np
import pytest

from scripts.errors import UsageError
from scripts.experiment import main
from scripts.experiments.drive import Course
from scripts.experiments.icp import VARIANTS, run_variant


@pytest.fixture(scope="module")
def course():
    return Course("aruco_room", 6.0, 3).drive()


def test_a_drive_follows_the_tour_by_the_truth_and_tells_it_at_every_scan(course):
    truth = course.truth_at_scans()
    assert len(truth) == len(course.scans) > 50
    np.testing.assert_array_equal(truth.stamps, [scan.stamp for scan in course.scans])
    np.testing.assert_allclose(truth.poses[0], 0.0, atol=0.01)
    assert np.hypot(*truth.poses[-1, :2]) > 0.5


def test_the_same_seed_gives_the_same_drive(course):
    again = Course("aruco_room", 6.0, 3).drive()
    np.testing.assert_array_equal(again.truth.poses, course.truth.poses)
    np.testing.assert_array_equal(again.scans[-1].ranges, course.scans[-1].ranges)


def test_every_way_to_choose_correspondences_finds_the_steps_from_a_good_guess(course):
    for name, icp in VARIANTS.items():
        outcome = run_variant(course, name, icp, "odometry")
        assert outcome.position_mm < 30.0
        assert outcome.converged > 0.9


def test_the_table_is_written(tmp_path):
    out = tmp_path / "icp.csv"
    assert main(["icp", "--duration", "2", "--guess", "none", "--csv", str(out)]) == 0
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert [row["name"] for row in rows] == [name.replace(",", ";") for name in VARIANTS]
    assert all(float(row["position_mm"]) > 0.0 for row in rows)


def test_an_unknown_experiment_lists_the_known_ones():
    with pytest.raises(UsageError, match="no experiment 'icq'; available: amcl_turns, convergence, "):
        main(["icq"])
