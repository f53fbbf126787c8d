import csv
import math

import numpy as np
import pytest

from scripts.errors import UsageError
from scripts.experiment import main
from scripts.experiments.arena import WorldErrors
from scripts.experiments.contest import Run
from scripts.experiments.disturbance import DISTURBED, QUIET, growth
from scripts.experiments.paper_table import figures_of


def run(condition, seed, x):
    stamps = np.arange(4.0)
    errors = WorldErrors(stamps, np.full(4, x), np.full(4, -2.0 * x), np.full(4, 0.5 * x))
    return Run("method", condition, seed, errors, np.zeros((4, 3)), np.zeros((4, 2)), np.array([0.0, 1.0, 0.0, 0.0]), np.array([1.0, 3.0]))


def test_the_figures_of_a_method_are_median_and_worst_of_its_seeds():
    figures = figures_of([run("", seed, x) for seed, x in enumerate((0.01, 0.03, 0.02))])
    assert figures["MAE x [cm]"] == pytest.approx((2.0, 3.0))
    assert figures["MAE y [cm]"] == pytest.approx((4.0, 6.0))
    assert figures["RMSE x [cm]"] == pytest.approx((2.0, 3.0))
    assert figures["worst [cm]"] == pytest.approx((2.0 * math.sqrt(5.0), 3.0 * math.sqrt(5.0)))
    assert figures["lost [%]"] == pytest.approx((25.0, 25.0))
    assert figures["ms a pose"] == pytest.approx((2.0, 2.0))


def test_growth_is_that_of_the_worst_seed():
    runs = [run(QUIET, 1, 0.01), run(DISTURBED, 1, 0.02), run(QUIET, 2, 0.02), run(DISTURBED, 2, 0.025)]
    assert growth(runs) == ["method: mean error grows by 1.00 cm in x, 2.00 cm in y, 0.29 deg at most"]


def test_a_run_can_be_narrowed_to_some_moments():
    part = run("", 1, 0.01).where(np.array([True, False, True, False]))
    assert len(part.errors.stamps) == len(part.places) == len(part.deviations) == len(part.lost) == 2


def test_the_corridor_experiment_prints_its_table_and_writes_its_files(tmp_path, capsys):
    command = ["corridor", "--duration", "4", "--seeds", "1", "--pipelines", "perfect_match", "--out", str(tmp_path)]
    assert main(command) == 0
    printed = capsys.readouterr().out
    assert "paper: perfect match" in printed
    assert "ratio" in printed
    assert (tmp_path / "errors.png").stat().st_size > 10_000
    with (tmp_path / "table.csv").open() as file:
        rows = {row["method"]: row for row in csv.DictReader(file)}
    assert float(rows["perfect_match"]["MAE y [cm]"]) < 3.0  # along the corridor so short a map says nothing


@pytest.mark.parametrize("argv", [["hall", "--duration", "1"], ["corridor", "--seeds", "-1"], ["disturbance", "--duration", "nan"]])
def test_options_that_make_no_sense_are_refused(argv):
    with pytest.raises(UsageError):
        main(argv)
