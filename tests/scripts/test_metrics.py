from dataclasses import replace

import numpy as np
import pytest

from scripts.runs.metrics import PLACE_OF_MAP, Timing, compute_metrics
from slam.errors import TrajectoryError
from slam.grid import OccupancyGrid
from slam.messages import Trajectory

TIMING = Timing(np.linspace(0.001, 0.003, 201), 3.0)
WITHOUT_TRUTH = {"frames", "frames_degraded", "frames_lost", "real_time_factor", "update_ms_median", "update_ms_p99"}
WITH_TRUTH = {
    "position_rmse_m",
    "position_max_m",
    "heading_rmse_deg",
    "odometry_position_rmse_m",
    "odometry_heading_rmse_deg",
    "odometry_ratio",
    *PLACE_OF_MAP,
    "wall_rms_m",
    "wall_recall",
    "iou",
}


def test_all_figures_are_there_with_truth(record):
    assert compute_metrics(record, TIMING).keys() == WITHOUT_TRUTH | WITH_TRUTH


def test_figures_that_need_the_truth_are_absent_without_it(record):
    assert compute_metrics(replace(record, truth=None, walls=None), TIMING).keys() == WITHOUT_TRUTH


def test_the_figures_are_those_of_the_noise_put_in(record):
    metrics = compute_metrics(record, TIMING)
    assert metrics["position_rmse_m"] == pytest.approx(0.006 * 2**0.5, rel=0.15)
    assert metrics["heading_rmse_deg"] == pytest.approx(np.degrees(0.003), rel=0.2)
    assert metrics["odometry_ratio"] == pytest.approx(metrics["odometry_position_rmse_m"] / metrics["position_rmse_m"])
    assert metrics["wall_recall"] > 0.98
    assert metrics["wall_rms_m"] < 0.015


def test_speed_and_status_are_counted(record):
    metrics = compute_metrics(record, TIMING)
    assert metrics["real_time_factor"] == pytest.approx(20.0)
    assert metrics["update_ms_median"] == pytest.approx(2.0)
    assert metrics["update_ms_p99"] == pytest.approx(2.98)
    assert (metrics["frames"], metrics["frames_degraded"], metrics["frames_lost"]) == (120, 1, 0)


def test_a_run_that_ended_before_its_first_frame_has_only_counts(record):
    nothing = Trajectory([], [])
    empty = replace(record, estimate=nothing, final=nothing, odometry=nothing, statuses=(), map=OccupancyGrid.empty(record.map.geometry))
    assert compute_metrics(empty, Timing(np.empty(0), 0.0)) == {"frames": 0, "frames_degraded": 0, "frames_lost": 0}


def test_a_map_without_walls_has_no_wall_error(record):
    metrics = compute_metrics(replace(record, map=OccupancyGrid.empty(record.map.geometry)), TIMING)
    assert "wall_rms_m" not in metrics
    assert metrics["wall_recall"] == 0.0


def test_truth_of_another_time_is_an_error(record):
    assert record.truth is not None
    with pytest.raises(TrajectoryError, match="no stamps within"):
        compute_metrics(replace(record, truth=Trajectory(record.truth.stamps + 1e4, record.truth.poses)), TIMING)
