import math

import numpy as np
import pytest
from PIL import Image

from hardware.errors import RecordingError
from scripts.errors import UsageError
from scripts.icp import main
from scripts.runs.files import OutputError
from scripts.scan_pairs import displaced_room, recorded_pair
from slam.errors import ParameterError, UnknownNameError
from slam.matching.matchers import MATCHERS


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A CoreSLAM log: a URG in the middle of a square room turns and drives a little, five scans."""
    path = tmp_path_factory.mktemp("log") / "square.dat"
    bearings = (np.arange(682) - 340) * math.tau / 1024
    rows = []
    for k in range(5):
        yaw = 0.02 * k
        ray = np.column_stack([np.cos(bearings + yaw), np.sin(bearings + yaw)])
        laser = 0.145 * np.array([math.cos(yaw), math.sin(yaw)])
        with np.errstate(divide="ignore"):
            ranges = np.min(np.where(ray > 0.0, 2.0 - laser, 1.5 + laser) / np.abs(ray), axis=1)
        ticks = round(0.165 * yaw / 0.077 * 2000 / math.tau)
        rows.append([100_000 * (k + 1), 0, -ticks, ticks, *[0] * 20, *np.rint(1000 * ranges).astype(int)])
    path.write_text("".join(" ".join(map(str, row)) + "\n" for row in rows))
    return path


def shown(picture, number):
    picture.seek(number)
    return np.asarray(picture.convert("RGB"), dtype=np.int64)


def test_the_check_passes_and_prints_the_answer(capsys):
    assert main([]) == 0
    printed = capsys.readouterr().out
    assert "ICP    x -1.866025 m  y -1.232051 m  yaw -30.00000 deg  converged" in printed
    assert "rms [mm]" in printed
    assert "check passed" in printed


def test_a_check_that_fails_exits_with_1(capsys):
    assert main(["--iterations", "3"]) == 1
    assert "check failed" in capsys.readouterr().out


def test_the_scan_of_the_check_is_not_the_answer_already():
    pair = displaced_room()
    assert np.abs(pair.source - pair.target).max() > 2.0
    np.testing.assert_allclose(pair.truth.transform(pair.source), pair.target, atol=1e-12)


def test_the_gif_has_a_frame_for_every_step_and_is_small(tmp_path):
    assert main(["--gif", str(tmp_path / "x.gif"), "--png", str(tmp_path / "x.png")]) == 0
    with Image.open(tmp_path / "x.gif") as picture:
        assert 30 < picture.n_frames <= 60
        assert np.mean(np.abs(shown(picture, 0) - shown(picture, picture.n_frames - 1)).max(axis=2) > 50) > 0.01
    assert (tmp_path / "x.gif").stat().st_size < 2_000_000
    assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("guess", ["wheels", "none"])
def test_two_scans_of_a_recording_are_registered_from_either_guess(recording, guess, capsys, tmp_path):
    main(["--log", str(recording), "--scans", "1", "4", "--guess", guess, "--gif", str(tmp_path / "x.gif")])
    printed = capsys.readouterr().out
    assert "square.dat, scan 4 on scan 1" in printed
    assert "wheels x" in printed
    assert "check" not in printed


def test_a_pair_of_a_recording_has_the_wheels_motion_and_no_truth(recording):
    pair = recorded_pair(recording, 2, 4)
    assert pair.wheels.yaw == pytest.approx(0.04, abs=1e-3)
    assert pair.truth is None


def test_a_scan_against_itself_stays_where_it_is(recording, capsys):
    assert main(["--log", str(recording), "--scans", "2", "2", "--png", str(recording.with_suffix(".png"))]) == 0
    assert "ICP    x 0.000000 m  y 0.000000 m  yaw 0.00000 deg" in capsys.readouterr().out.replace("-0.0", "0.0")


@pytest.mark.parametrize("name", [name for name in MATCHERS if name != "icp"])
def test_other_matchers_lay_a_pair_of_a_recording_too(recording, name, capsys, tmp_path):
    assert main(["--log", str(recording), "--scans", "1", "3", "--matcher", name, "--gif", str(tmp_path / "x.gif")]) == 0
    printed = capsys.readouterr().out
    assert f"{name} is" in printed
    assert "the scan allows" in printed
    with Image.open(tmp_path / "x.gif") as picture:
        assert picture.n_frames == 2


def test_the_check_is_icps_alone():
    with pytest.raises(UsageError, match="--matcher ndt needs --log"):
        main(["--matcher", "ndt"])


def test_a_matcher_that_is_not_there_is_one_line():
    with pytest.raises(UnknownNameError, match="no matcher 'magic'; available: correlative, gauss_newton, icp, ndt, plicp"):
        main(["--matcher", "magic"])


@pytest.mark.parametrize("scans", [("0", "5"), ("-1", "2")])
def test_a_scan_that_is_not_there_is_one_line(recording, scans):
    with pytest.raises(UsageError, match=r"square\.dat has 5 scans, the first is number 0"):
        main(["--log", str(recording), "--scans", *scans])


@pytest.mark.parametrize(("option", "path"), [("--gif", "x.png"), ("--png", "x.gif")])
def test_a_picture_of_the_wrong_kind_is_refused_before_the_work(option, path):
    with pytest.raises(UsageError, match=f"{option} {path}: must end in .{option[2:]}"):
        main([option, path])


def test_an_unwritable_folder_is_one_line(tmp_path):
    with pytest.raises(OutputError, match="cannot write"):
        main(["--gif", str(tmp_path / "gone" / "x.gif")])


def test_a_recording_that_is_not_there_is_one_line():
    with pytest.raises(RecordingError, match="No such file"):
        main(["--log", "gone.dat"])


def test_an_impossible_parameter_is_one_line():
    with pytest.raises(ParameterError, match="must be above 0 and at most 1"):
        main(["--trim", "2"])
