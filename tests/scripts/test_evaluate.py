import json

import pytest

from scripts.cli import main
from scripts.evaluation.statistics import bootstrap

SHORT = ["--difficulty", "easy", "--maps", "2", "--duration", "3"]


def test_the_table_and_the_curves_are_the_same_for_any_number_of_processes(tmp_path):
    episodes = []
    for processes in ("1", "2"):
        out = tmp_path / processes
        assert main(["evaluate", "wander", "nearest", *SHORT, "--processes", processes, "--out", str(out)]) == 0
        assert (out / "curves.png").stat().st_size > 10_000
        assert "| nearest |" in (out / "table.md").read_text()
        episodes.append([{**e, "decision_ms": 0.0} for e in json.loads((out / "episodes.json").read_text())])
    assert episodes[0] == episodes[1]
    assert [e["explorer"] for e in episodes[0]] == ["wander", "wander", "nearest", "nearest"]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (["nearby"], "no explorer 'nearby'; available: random"),
        (["--maps", "0"], "--maps 0: give 1 or more"),
        (["--seed", "-1"], "--seed"),
    ],
)
def test_a_wrong_option_is_one_line(wrong, message, capsys):
    assert main(["evaluate", *wrong]) == 2
    assert message in capsys.readouterr().err


def test_a_bootstrap_interval_holds_the_mean_and_repeats():
    mean, low, high = bootstrap([1.0, 2.0, 3.0, 4.0])
    assert low < mean == 2.5 < high
    assert bootstrap([1.0, 2.0, 3.0, 4.0]) == (mean, low, high)


def test_worlds_splits_compares_maps_with_their_digests(capsys):
    assert main(["worlds", "splits", "--every", "500"]) == 0
    assert "11 maps as they were frozen" in capsys.readouterr().out
