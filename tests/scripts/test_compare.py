import csv

import pytest
from PIL import Image

from scripts.cli import main
from slam.map_file import read_map


@pytest.fixture(scope="module")
def compared(tmp_path_factory):
    out = tmp_path_factory.mktemp("compared")
    arguments = ["--world", "aruco_room", "--robot", "kinematic", "--duration", "8", "--pipelines", "odometry", "lidar", "mcl"]
    assert main(["compare", *arguments, "--out", str(out)]) == 0
    return out


def test_every_pipeline_has_its_row_and_its_run(compared):
    rows = {row["pipeline"]: row for row in csv.DictReader((compared / "compare.csv").read_text().splitlines())}
    assert list(rows) == ["odometry", "lidar", "mcl"]
    assert float(rows["lidar"]["position_rmse_m"]) < 0.02
    assert float(rows["mcl"]["position_rmse_m"]) < 0.3
    assert {row["frames"] for row in rows.values()} == {"200"}
    assert all((compared / name / "report.html").is_file() for name in rows)


def test_the_page_leads_to_every_run_and_says_how_it_was_scored(compared):
    page = (compared / "compare.html").read_text()
    assert all(f'href="{name}/report.html"' in page for name in ("odometry", "lidar", "mcl"))
    assert page.count("<td>aligned</td>") == 2
    assert page.count("<td>in its map</td>") == 1
    with Image.open(compared / "compare.png") as picture:
        assert picture.size == (1920, 1080)


def test_the_map_was_made_on_another_drive(compared):
    assert len(read_map(compared / "map" / "map.yaml").wall_points()) > 100
    assert "seed = 1" in (compared / "map" / "config.toml").read_text()


def test_a_recording_is_compared_as_it_is(compared, tmp_path, capsys):
    assert main(["compare", str(compared / "drive"), "--pipelines", "odometry", "--out", str(tmp_path)]) == 0
    assert "odometry" in capsys.readouterr().out
    again = {row["pipeline"]: row for row in csv.DictReader((tmp_path / "compare.csv").read_text().splitlines())}
    before = {row["pipeline"]: row for row in csv.DictReader((compared / "compare.csv").read_text().splitlines())}
    assert again["odometry"]["position_rmse_m"] == before["odometry"]["position_rmse_m"]


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        ("--pipelines lidr", "no pipeline 'lidr'; available: "),
        ("--pipelines lidar lidar", "--pipelines: name one or more, each once"),
        ("nowhere --pipelines mcl", "mcl: localised in a map; give --map"),
        ("nowhere --pipelines lidar", "recording nowhere: cannot be read"),
        ("--world nowhere --pipelines lidar", "no world 'nowhere'"),
    ],
)
def test_what_cannot_be_compared_is_said_in_one_line(arguments, problem, capsys, tmp_path):
    assert main(["compare", *arguments.split(), "--out", str(tmp_path)]) == 2
    assert problem in capsys.readouterr().err
