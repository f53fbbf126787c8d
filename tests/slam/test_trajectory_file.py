import math
from pathlib import Path

import numpy as np
import pytest
from evo.tools import file_interface
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.errors import TrajectoryError
from slam.messages import Trajectory
from slam.trajectory_file import read_trajectory, write_trajectory

poses = st.lists(st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-3.14, 3.14)), max_size=5)


@settings(deadline=None)
@given(poses)
def test_what_is_written_is_read_again(tmp_path_factory, rows):
    path = tmp_path_factory.mktemp("tum") / "x.tum"
    written = Trajectory(np.arange(len(rows)) * 0.1, rows)
    write_trajectory(path, written)
    read = read_trajectory(path)
    assert np.allclose(read.stamps, written.stamps, atol=1e-9)
    assert np.allclose(read.poses, written.poses, atol=1e-9)


def test_evo_reads_what_is_written(tmp_path):
    write_trajectory(tmp_path / "x.tum", Trajectory([1.5, 2.5], [(1, 2, 0.5), (3, 4, -3.0)]))
    read = file_interface.read_tum_trajectory_file(tmp_path / "x.tum")
    assert read.timestamps.tolist() == [1.5, 2.5]
    assert read.get_orientations_euler()[:, 2] == pytest.approx([0.5, -3.0])
    assert read.positions_xyz.tolist() == [[1, 2, 0], [3, 4, 0]]


def test_a_tilted_pose_is_projected_on_the_floor(tmp_path):
    half = math.radians(45)
    (tmp_path / "x.tum").write_text(f"# stamp x y z qx qy qz qw\n\n1 2 3 4 0 0 {math.sin(half)} {math.cos(half)}\n")
    assert read_trajectory(tmp_path / "x.tum").poses[0] == pytest.approx([2, 3, math.pi / 2])


def test_a_public_file_is_read(shared_data):
    assert len(read_trajectory(shared_data / "trajectories" / "freiburg1_xyz-groundtruth.txt")) > 2000


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1 2 3\n", "line 1: '1 2 3'"),
        ("# fine\n1 0 0 0 0 0 0 one\n", "line 2"),
        ("1 0 nan 0 0 0 0 1\n", "line 1"),
        ("2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n", r"run back, they do after 2\.000000 s"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line(tmp_path, text, message):
    (tmp_path / "x.tum").write_text(text)
    with pytest.raises(TrajectoryError, match=message) as caught:
        read_trajectory(tmp_path / "x.tum")
    assert "\n" not in str(caught.value)


def test_bytes_that_are_no_text_are_refused(tmp_path):
    (tmp_path / "x.tum").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(TrajectoryError, match="is not text"):
        read_trajectory(tmp_path / "x.tum")


def test_a_missing_file_is_refused():
    with pytest.raises(TrajectoryError, match="No such file"):
        read_trajectory(Path("nowhere.tum"))


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(TrajectoryError, match="cannot be written: No such file"):
        write_trajectory(tmp_path / "nowhere" / "x.tum", Trajectory([], []))
