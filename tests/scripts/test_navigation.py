"""Policies that have an end, from the command line."""

import json

import pytest

from scripts.cli import main

SMALL = """
name = "closet"
start = [0.6, 0.6, 0.3]
[[wall]]
from = [0.0, 0.0]
to = [2.4, 0.0]
thickness = 0.1
height = 1.0
[[wall]]
from = [2.4, 0.0]
to = [2.4, 1.8]
thickness = 0.1
height = 1.0
[[wall]]
from = [2.4, 1.8]
to = [0.0, 1.8]
thickness = 0.1
height = 1.0
[[wall]]
from = [0.0, 1.8]
to = [0.0, 0.0]
thickness = 0.1
height = 1.0
[[wall]]
from = [1.2, 0.0]
to = [1.2, 0.9]
thickness = 0.1
height = 1.0
"""


@pytest.fixture(scope="module")
def explored(tmp_path_factory):
    folder = tmp_path_factory.mktemp("explored")
    (folder / "closet.toml").write_text(SMALL)
    arguments = ["run", "--robot", "kinematic", "--world", str(folder / "closet.toml"), "--pipeline", "lidar_slam", "--policy", "explore"]
    assert main([*arguments, "--out", str(folder / "run")]) == 0
    return folder


def test_an_exploration_ends_by_itself_and_says_why(explored) -> None:
    metrics = json.loads((explored / "run" / "metrics.json").read_text())
    assert metrics["coverage"] > 0.98
    assert metrics["collisions"] == 0
    assert "the robot is back at its start" in (explored / "run" / "report.html").read_text()


def test_a_goal_in_a_wall_of_a_given_map_is_one_line(explored, capsys) -> None:
    world = str(explored / "closet.toml")
    arguments = ["run", "--robot", "kinematic", "--world", world, "--pipeline", "perfect_match", "--map", str(explored / "run")]
    assert main([*arguments, "--policy", "goal", "--goal", "50", "0", "--out", str(explored / "goal")]) == 2
    assert capsys.readouterr().err == "twin: the goal (50, 0) lies outside the map\n"


@pytest.mark.parametrize(
    "arguments",
    [["--policy", "goal"], ["--goal", "1", "2"], ["--policy", "explore", "--goal", "1", "2"]],
    ids=["no goal", "tour", "explore"],
)
def test_a_goal_and_its_policy_belong_together(arguments, capsys) -> None:
    assert main(["run", *arguments]) == 2
    assert "--goal X Y and --policy goal belong together" in capsys.readouterr().err


@pytest.mark.parametrize("goal", [("nan", "0"), ("1e9", "0")])
def test_a_goal_that_is_nowhere_is_refused(goal, capsys) -> None:
    assert main(["run", "--policy", "goal", "--goal", *goal]) == 2
    assert "give finite numbers" in capsys.readouterr().err


def test_an_unknown_explorer_lists_the_known_ones(capsys) -> None:
    assert main(["run", "--policy", "explore", "--explorer", "farthest"]) == 2
    assert "nearest" in capsys.readouterr().err
