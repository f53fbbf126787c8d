import tomllib
from pathlib import Path

import pytest

from hardware.faults import StuckWheel
from scripts.pytest_plugin import twin_run

pytest_plugins = ["pytester"]
__all__ = ["twin_run"]

ROOT = Path(__file__).parents[2]
USERS = """
from hardware.faults import Unplugged

def test_tour(twin_run):
    run = twin_run(robot="kinematic", world="aruco_room", pipeline="lidar", duration=4)
    assert run.metrics["position_rmse_m"] < 0.02

def test_without_the_gyro(twin_run):
    run = twin_run(robot="kinematic", duration=4, faults=[Unplugged("imu", start=1.0)])
    assert run.metrics["position_rmse_m"] < 0.02
    assert run.metrics["frames_degraded"] > 0

def test_that_fails(twin_run):
    assert twin_run(robot="kinematic", pipeline="odometry", duration=1).metrics["wall_recall"] > 1.0

def test_misspelt(twin_run):
    twin_run(world="aruco_rom")
"""


@pytest.fixture
def users(pytester, monkeypatch):
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    pytester.makepyfile(USERS)
    return pytester.runpytest_subprocess("-p", "scripts.pytest_plugin")


def test_users_write_headless_tests_with_ground_truth(users):
    users.assert_outcomes(passed=2, failed=2)
    users.stdout.fnmatch_lines(["E*assert * > 1.0*", "E*no world 'aruco_rom'; available: *"])


def test_the_plugin_is_an_entry_point():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["entry-points"]["pytest11"] == {"bricktwin": "scripts.pytest_plugin"}


def test_a_run_has_all_that_is_known(twin_run, tmp_path):
    run = twin_run(robot="kinematic", duration=2, seed=3, realism="ideal")
    assert len(run.estimate) == len(run.truth) == run.metrics["frames"] == 50
    assert run.walls is not None
    assert len(run.map.wall_points()) > 100
    assert list(tmp_path.iterdir()) == []


def test_faults_draw_by_the_seed_of_the_run(twin_run):
    runs = [twin_run(robot="kinematic", duration=2, seed=seed, faults=[StuckWheel("left", start=1.0)]) for seed in (1, 1, 2)]
    first, again, other = (run.estimate.poses.tobytes() for run in runs)
    assert first == again != other
