import json

import numpy as np
import pytest

from scripts.cli import main
from scripts.evaluation import ranking
from scripts.evaluation.episode import Trial, run
from scripts.evaluation.statistics import bootstrap
from worlds.splits import MapName

SHORT = ["--difficulty", "easy", "--maps", "2", "--duration", "3"]


def episodes_of(folder):
    """What was run, without the one number that no seed repeats."""
    return [{**episode, "decision_ms": 0.0} for episode in json.loads((folder / "episodes.json").read_text())]


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    out = tmp_path_factory.mktemp("alone")
    assert main(["evaluate", "wander", "nearest", *SHORT, "--processes", "1", "--out", str(out)]) == 0
    return out


def test_the_results_are_the_same_for_any_number_of_processes(alone, tmp_path):
    assert main(["evaluate", "wander", "nearest", *SHORT, "--processes", "2", "--out", str(tmp_path)]) == 0
    assert episodes_of(tmp_path) == episodes_of(alone)
    assert [e["explorer"] for e in episodes_of(alone)] == ["wander", "wander", "nearest", "nearest"]


def test_a_table_and_curves_are_written(alone):
    assert (alone / "curves.png").stat().st_size > 10_000
    assert "| nearest |" in (alone / "table.md").read_text()


def test_two_nodes_of_ray_give_the_same_results(alone, tmp_path, capsys):
    pytest.importorskip("ray", reason="an optional extra")
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    try:
        cluster.add_node(num_cpus=1)
        order = ["evaluate", "wander", "nearest", *SHORT, "--engine", "ray", "--address", cluster.address, "--out", str(tmp_path)]
        assert main(order) == 0
    finally:
        cluster.shutdown()
    assert "4 episodes by Ray on 2 nodes" in capsys.readouterr().err
    assert episodes_of(tmp_path) == episodes_of(alone)


def test_a_page_has_the_table_the_curves_and_the_command(tmp_path):
    page, out = tmp_path / "page.md", tmp_path / "out"
    short = ["--difficulty", "easy", "--maps", "1", "--duration", "4", "--processes", "1"]
    assert main(["evaluate", "wander", *short, "--slam-maps", "1", "--markdown", str(page), "--out", str(out)]) == 0
    text = page.read_text()
    assert "`twin evaluate wander --difficulty easy" in text
    assert "![Area seen over the time](page.png)" in text
    assert (tmp_path / "page.png").stat().st_size > 10_000
    line = next(line for line in text.splitlines() if line.startswith("| wander |"))
    error, overlap = (float(cell.split()[0]) for cell in line.split("|")[-3:-1])
    assert 0.0 < error < 5.0
    assert overlap > 50.0


def test_two_twins_are_compared_by_the_order_of_their_explorers(tmp_path, capsys):
    short = ["--difficulty", "easy", "--maps", "1", "--duration", "2", "--processes", "1"]
    assert main(["evaluate", "wander", "nearest", *short, "--against", "sim", "--out", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "order on kinematic, then on sim" in said
    assert "the same order" in said


def test_explorers_change_places_only_beyond_their_intervals():
    one = {"a": (9.0, 8.0, 10.0), "b": (5.0, 4.0, 6.0), "c": (5.5, 4.5, 6.5)}
    assert [ranking.rank(name, one) for name in one] == [1, 2, 2]
    tied = {"a": (5.0, 4.0, 6.0), "b": (5.5, 4.5, 6.5), "c": (9.0, 8.0, 10.0)}
    assert ranking.reversals(one, one) == []
    assert ranking.reversals(one, tied) == [("a", "c")]
    assert "a is better than c" in ranking.verdict(one, tied)


def test_the_errors_of_pose_and_map_are_kept_where_the_pose_is_not_the_truth():
    text = MapName("test", "easy", 0).text
    known, believed = (run(Trial("wander", text, 0, "kinematic", pose, 30)) for pose in ("truth", "odometry"))
    assert (known.pose_error, known.iou) == (None, None)
    assert believed.pose_error is not None
    assert 0.0 <= believed.pose_error < 0.05
    assert believed.iou is not None
    assert np.isfinite(believed.iou)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (["nearby"], "no explorer 'nearby'; available: random"),
        (["--maps", "0"], "--maps 0: give 1 or more"),
        (["--seed", "-1"], "--seed"),
        (["--slam-maps", "3", "--pose", "slam"], "--slam-maps adds to another pose"),
        (["--against", "kinematic"], "--against kinematic is what explores already"),
        (["--address", "auto"], "add --engine ray"),
    ],
)
def test_a_wrong_option_is_one_line(wrong, message, capsys):
    assert main(["evaluate", *wrong]) == 2
    assert message in capsys.readouterr().err


def test_a_cluster_that_is_not_there_is_one_line(capsys):
    pytest.importorskip("ray", reason="an optional extra")
    assert main(["evaluate", "wander", *SHORT, "--engine", "ray", "--address", "127.0.0.1:1"]) == 2
    assert "no Ray cluster answers at '127.0.0.1:1'" in capsys.readouterr().err


def test_a_bootstrap_interval_holds_the_mean_and_repeats():
    mean, low, high = bootstrap([1.0, 2.0, 3.0, 4.0])
    assert low < mean == 2.5 < high
    assert bootstrap([1.0, 2.0, 3.0, 4.0]) == (mean, low, high)


def test_worlds_splits_compares_maps_with_their_digests(capsys):
    assert main(["worlds", "splits", "--every", "500"]) == 0
    assert "11 maps as they were frozen" in capsys.readouterr().out
