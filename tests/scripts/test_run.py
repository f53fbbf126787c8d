import filecmp
import json
import tomllib

import pytest
from PIL import Image

from hardware.logs.registry import open_log
from scripts.cli import main
from scripts.runs.folder import RESULTS, results_folder
from scripts.runs.options import RunOptions
from slam.map_file import read_map
from slam.trajectory_file import read_trajectory

OF_A_REPLAY = {name for name in RESULTS if not name.startswith("true_map")}


def run(folder, *argv):
    """Run the command into a folder; returns its metrics."""
    assert main(["run", *argv, "--out", str(folder)]) == 0
    return json.loads((folder / "metrics.json").read_text())


def test_a_recorded_run_leaves_all_its_files(recorded_run):
    assert {path.name for path in recorded_run.iterdir()} == {*RESULTS, "config.toml", "recording.mcap", "metadata.yaml"}
    assert len(read_trajectory(recorded_run / "trajectory.tum")) == 200
    assert len(read_map(recorded_run / "map.yaml").wall_points()) > 100
    with Image.open(recorded_run / "report.png") as picture:
        assert picture.size == (1920, 1080)


def test_the_figures_of_a_run_are_those_of_a_good_run(recorded_run):
    metrics = json.loads((recorded_run / "metrics.json").read_text())
    assert metrics["position_rmse_m"] < 0.02
    assert metrics["wall_recall"] > 0.8
    assert metrics["frames"] == 200


@pytest.fixture(scope="module")
def replayed(recorded_run, tmp_path_factory):
    folder = tmp_path_factory.mktemp("replayed")
    run(folder, "--robot", f"replay:{recorded_run}")
    return folder


@pytest.mark.parametrize("name", ["trajectory_final.tum", "trajectory.tum", "odometry.tum", "map.pgm", "map.yaml"])
def test_a_replay_gives_the_same_bits(name, recorded_run, replayed):
    assert filecmp.cmp(recorded_run / name, replayed / name, shallow=False)


def test_a_replay_has_the_truth_of_the_run(recorded_run, replayed):
    live, again = (json.loads((folder / "metrics.json").read_text()) for folder in (recorded_run, replayed))
    for figure in ("position_rmse_m", "heading_rmse_deg", "odometry_position_rmse_m", "wall_rms_m", "wall_recall"):
        assert again[figure] == pytest.approx(live[figure], rel=0.2)
    assert {path.name for path in replayed.iterdir()} == {*OF_A_REPLAY, "config.toml"}


def test_the_config_of_a_replay_does_not_speak_of_a_simulation(replayed, recorded_run):
    assert tomllib.loads((replayed / "config.toml").read_text())["run"] == {
        "robot": f"replay:{recorded_run}",
        "pipeline": "lidar",
        "out": str(replayed),
        "record": False,
    }


def test_the_config_of_a_run_repeats_it(recorded_run, tmp_path):
    config = recorded_run / "config.toml"
    options = tomllib.loads(config.read_text())["run"]
    assert (options["world"], options["seed"], options["duration"]) == ("aruco_room", 3, 8.0)
    run(tmp_path, "--robot", f"replay:{recorded_run}", "--params", str(config))
    assert filecmp.cmp(recorded_run / "trajectory_final.tum", tmp_path / "trajectory_final.tum", shallow=False)


def test_parameters_from_a_file_are_used_and_kept(recorded_run, tmp_path):
    parameters = tmp_path / "fine.toml"
    parameters.write_text("[map]\nresolution = 0.1\n")
    run(tmp_path / "out", "--robot", f"replay:{recorded_run}", "--params", str(parameters), "--duration", "2")
    assert read_map(tmp_path / "out" / "map.yaml").geometry.resolution == 0.1
    assert tomllib.loads((tmp_path / "out" / "config.toml").read_text())["parameters"]["map"]["resolution"] == 0.1


def test_a_bare_recording_replays_from_a_start_for_a_while_and_is_recorded_again(recorded_run, tmp_path):
    options = ("--pipeline", "odometry", "--start", "1", "-2", "90", "--duration", "3", "--policy", "none", "--record")
    run(tmp_path, "--robot", f"replay:{recorded_run / 'recording.mcap'}", *options)
    trajectory = read_trajectory(tmp_path / "trajectory.tum")
    assert trajectory.stamps[-1] == pytest.approx(3.0)
    assert trajectory.poses[0] == pytest.approx([1.0, -2.0, 1.5708], abs=0.01)
    assert open_log(tmp_path).span[1] == pytest.approx(3.0, abs=0.05)


@pytest.mark.parametrize("rays", ["embree", "bullet"])
def test_another_world_with_other_devices_runs(rays, tmp_path):
    metrics = run(tmp_path, "--world", "corridor", "--rays", rays, "--realism", "ideal", "--duration", "1", "--seed", "5")
    assert metrics["position_rmse_m"] < 0.01


def test_the_kinematic_twin_runs_with_the_same_options_and_truth(tmp_path):
    options = ("--world", "corridor", "--rays", "grid", "--realism", "ideal", "--duration", "2", "--seed", "5", "--record")
    metrics = run(tmp_path / "live", "--robot", "kinematic", *options)
    assert metrics["position_rmse_m"] < 0.01
    assert {path.name for path in (tmp_path / "live").iterdir()} == {*RESULTS, "config.toml", "recording.mcap", "metadata.yaml"}
    again = run(tmp_path / "replayed", "--robot", f"replay:{tmp_path / 'live'}")
    assert again["wall_rms_m"] == pytest.approx(metrics["wall_rms_m"], rel=0.2)


def test_a_robot_that_stands_still_is_estimated_to_stand_still(tmp_path):
    run(tmp_path, "--policy", "none", "--duration", "1")
    assert abs(read_trajectory(tmp_path / "trajectory_final.tum").poses).max() < 0.01


def test_a_run_of_one_frame_without_a_scan_has_all_files(tmp_path, capsys):
    metrics = run(tmp_path, "--duration", "0.001")
    assert metrics["frames"] == 1
    assert {path.name for path in tmp_path.iterdir()} == {*RESULTS, "config.toml"}
    assert "The map has 0 occupied cells" in capsys.readouterr().out


@pytest.mark.parametrize("log", ["urg04lx/exp1.dat", "intel-lab/intel.log"])
def test_recordings_of_others_run(log, shared_data, tmp_path, capsys):
    metrics = run(tmp_path, "--robot", f"replay:{shared_data / log}", "--duration", "5")
    assert metrics["frames"] >= 125
    assert "position_rmse_m" not in metrics
    assert str(tmp_path / "report.png") in capsys.readouterr().out


def test_results_of_an_earlier_run_do_not_stay_beside_new_ones(recorded_run, tmp_path):
    run(tmp_path, "--duration", "0.5")
    assert (tmp_path / "true_map.pgm").is_file()
    run(tmp_path, "--robot", f"replay:{recorded_run}", "--duration", "0.5")
    assert {path.name for path in tmp_path.iterdir()} == {*OF_A_REPLAY, "config.toml"}


def test_a_run_without_a_recording_leaves_an_earlier_one_alone_and_its_world_is_no_longer_known(tmp_path):
    run(tmp_path / "both", "--duration", "1", "--record")
    recording = (tmp_path / "both" / "recording.mcap").read_bytes()
    run(tmp_path / "both", "--duration", "1", "--world", "corridor")
    assert (tmp_path / "both" / "recording.mcap").read_bytes() == recording
    metrics = run(tmp_path / "out", "--robot", f"replay:{tmp_path / 'both'}")
    assert "position_rmse_m" in metrics
    assert "wall_rms_m" not in metrics


def test_a_config_that_cannot_be_read_costs_a_replay_only_its_walls(tmp_path, caplog):
    run(tmp_path / "live", "--duration", "1", "--record")
    (tmp_path / "live" / "config.toml").write_text("[run")
    metrics = run(tmp_path / "out", "--robot", f"replay:{tmp_path / 'live'}")
    assert "position_rmse_m" in metrics
    assert "wall_rms_m" not in metrics
    assert "the true walls are not known" in caplog.text


@pytest.mark.parametrize(
    ("options", "folder"),
    [
        (RunOptions(), "runs/aruco_room-lidar"),
        (RunOptions(world="aruco_room:size=6", pipeline="odometry"), "runs/aruco_room-odometry"),
        (RunOptions(world="maps/mine.toml"), "runs/mine-lidar"),
        (RunOptions(robot="replay:logs/exp1.dat"), "runs/exp1-lidar"),
        (RunOptions(robot="replay:runs/demo/recording.mcap"), "runs/demo-lidar"),
    ],
)
def test_a_run_is_named_after_its_world_or_recording_and_its_pipeline(options, folder):
    assert str(results_folder(options)) == folder
