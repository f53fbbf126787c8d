"""`twin experiment markers`, from the command line."""

import csv
from pathlib import Path

import cv2
import pytest

from scripts.cli import main


def test_chain_and_graph_map_the_same_drives_and_the_graph_is_better(tmp_path: Path) -> None:
    assert main(["experiment", "markers", "--spacings", "0.5", "--duration", "8", "--out", str(tmp_path)]) == 0
    with (tmp_path / "markers.csv").open() as file:
        rows = {(row["policy"], row["method"]): row for row in csv.DictReader(file)}
    assert set(rows) == {(policy, method) for policy in ("spin", "perimeter") for method in ("chain", "graph")}
    for policy in ("spin", "perimeter"):
        graph, chain = rows[policy, "graph"], rows[policy, "chain"]
        assert int(graph["mapped"]) >= 4
        assert float(graph["rms_mm"]) < float(chain["rms_mm"])
    assert cv2.imread(str(tmp_path / "markers.png")).shape[1] == 1760


@pytest.mark.parametrize(("argv", "problem"), [(["--duration", "0"], "at least 1 second"), (["--spacings", "0.01"], "spacing")])
def test_what_cannot_be_driven_is_refused(argv: list[str], problem: str, capsys) -> None:
    assert main(["experiment", "markers", *argv]) == 2
    assert problem in capsys.readouterr().err
