from pathlib import Path

from scripts.bench.marker_photographs import photograph_rows


def test_photographs_show_all_markers_and_no_others_and_calibrate_the_camera(shared_data: Path, monkeypatch) -> None:
    monkeypatch.setenv("BRICKTWIN_DATA", str(shared_data))
    values = {row.name.split(", ", 1)[-1]: row.value for row in photograph_rows()}
    assert values["126 markers, missed"] == 0
    assert values["126 markers, false"] == 0
    assert values["RMS"] <= 0.3
    assert values["farthest from solvePnP's pose by the same corners, position"] <= 2.0
    assert values["farthest from solvePnP's pose by the same corners, rotation"] <= 0.2
