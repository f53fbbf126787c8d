"""`twin experiment explore`, from the command line."""

import json
from dataclasses import replace

import pytest

from scripts.cli import main
from scripts.experiments.explore import Exploration, summary

SHORT = ["experiment", "explore", "--difficulty", "easy", "--maps", "2", "--duration", "3"]
GOOD = Exploration("cave:seed=1", 1, ended=True, reason="mapped", coverage=0.995, time=100.0, path=20.0, rmse=0.01)


def test_any_number_of_processes_tells_the_same(tmp_path):
    told = []
    for processes in ("1", "2"):
        out = tmp_path / f"{processes}.json"
        assert main([*SHORT, "--processes", processes, "--json", str(out)]) == 0
        told.append(out.read_text())
    assert told[0] == told[1]
    assert [one["world"].partition(":")[0] for one in json.loads(told[0])] == ["burrow", "cave"]
    assert not any(one["ended"] for one in json.loads(told[0]))


def test_a_map_that_was_not_finished_is_named_with_the_command_that_repeats_it(capsys):
    assert main([*SHORT[:-1], "2", "--maps", "1", "--first", "1", "--processes", "1"]) == 0
    told = capsys.readouterr().out
    assert "the time is over" in told
    assert "twin run --robot kinematic --world cave:" in told


@pytest.mark.parametrize("wrong", [{"ended": False}, {"coverage": 0.979}, {"collisions": 1}])
def test_an_exploration_is_good_when_it_ends_has_seen_98_percent_and_touched_nothing(wrong):
    assert GOOD.is_good
    assert not replace(GOOD, **wrong).is_good


def test_the_summary_has_a_line_for_each_family_and_one_for_all():
    table = summary([GOOD, replace(GOOD, world="maze:seed=2", coverage=0.5)])
    assert list(table.columns[0].cells) == ["cave", "maze", "all"]
    assert list(table.columns[2].cells) == ["1 (100.0 %)", "0 (0.0 %)", "1 (50.0 %)"]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (["--maps", "0"], "--maps: 1 or above"),
        (["--first", "500"], "--first 500: there are not so many such maps"),
        (["--family", "castle"], "no family 'castle'; available: burrow"),
        (["--robot", "ev3"], "--robot"),
        (["--pipeline", "amcl"], "'amcl'"),
    ],
)
def test_a_wrong_option_is_one_line(wrong, message, capsys):
    assert main(["experiment", "explore", "--processes", "1", *wrong]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
