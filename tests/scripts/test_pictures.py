from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from scripts.runs.animation import write_gif
from scripts.runs.files import OutputError
from scripts.runs.metrics import Timing, compute_metrics
from scripts.runs.palette import ESTIMATE, OCCUPIED, ODOMETRY
from scripts.runs.pictures import write_report_png
from slam.grid import OccupancyGrid
from slam.messages import Trajectory


@pytest.fixture(scope="module")
def bare(record):
    """A run without truth."""
    return replace(record, truth=None, walls=None)


@pytest.fixture(scope="module")
def empty(bare):
    """A run that ended before its first frame."""
    nothing = Trajectory([], [])
    return replace(bare, estimate=nothing, final=nothing, odometry=nothing, key_frames=(), map=OccupancyGrid.empty(bare.map.geometry))


def share(picture, colour):
    pixels = np.asarray(picture.convert("RGB"), dtype=np.int64)
    return float(np.mean(np.abs(pixels - list(bytes.fromhex(colour[1:]))).max(axis=2) < 24))


def test_the_report_is_16_to_9_and_shows_map_and_lines(record, tmp_path):
    complete = replace(record, metrics=compute_metrics(record, Timing(np.full(9, 0.002), 3.0)))
    write_report_png(tmp_path / "report.png", complete)
    with Image.open(tmp_path / "report.png") as picture:
        assert picture.size == (1920, 1080)
        assert share(picture, OCCUPIED) > 0.005
        assert share(picture, ESTIMATE) > 0.001
        assert share(picture, ODOMETRY) > 0.001


@pytest.mark.parametrize("kind", ["bare", "empty"])
def test_the_report_is_made_with_whatever_is_known(kind, tmp_path, request):
    write_report_png(tmp_path / "report.png", request.getfixturevalue(kind))
    assert [path.name for path in tmp_path.iterdir()] == ["report.png"]


@pytest.mark.parametrize(("kind", "frames"), [("record", 24), ("bare", 24), ("empty", 1)])
def test_the_animation_has_a_frame_for_each_key_frame_and_is_short(kind, frames, tmp_path, request):
    write_gif(tmp_path / "run.gif", request.getfixturevalue(kind))
    with Image.open(tmp_path / "run.gif") as picture:
        assert getattr(picture, "n_frames", 1) == frames
    assert (tmp_path / "run.gif").stat().st_size < 4_000_000


def test_the_animation_of_a_long_run_lasts_at_most_12_seconds(record, tmp_path):
    write_gif(tmp_path / "run.gif", replace(record, key_frames=record.key_frames * 5))
    duration_ms = 0
    with Image.open(tmp_path / "run.gif") as picture:
        for index in range(picture.n_frames):
            picture.seek(index)
            duration_ms += picture.info["duration"]
    assert duration_ms <= 12_000


def test_the_map_grows_in_the_animation(record, tmp_path):
    start = record.key_frames[0]
    blank = replace(start, states=np.full_like(start.states, -1))
    write_gif(tmp_path / "run.gif", replace(record, key_frames=(blank, *record.key_frames)))
    with Image.open(tmp_path / "run.gif") as picture:
        first = share(picture, OCCUPIED)
        picture.seek(picture.n_frames - 1)
        assert share(picture, OCCUPIED) > first + 0.02


@pytest.mark.parametrize("write", [write_report_png, write_gif])
def test_a_folder_that_is_not_there_is_one_line(write, empty, tmp_path):
    with pytest.raises(OutputError, match="cannot write"):
        write(tmp_path / "gone" / "x.png", empty)
