"""Marker maps: anchored, written, read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slam.landmarks.marker_map import MappedMarker, MarkerMap, MarkerMapError
from slam.landmarks.marker_map_file import MarkerMapFileError, read_aruco_map, read_marker_map, write_aruco_map, write_marker_map
from slam.se2 import SE2
from slam.se3 import SE3

DICTIONARY = "DICT_ARUCO_MIP_36h12"


def mapped(number: int, *xi: float) -> MappedMarker:
    A = np.random.default_rng(number).normal(size=(6, 6))
    return MappedMarker(number, 0.1 + 0.01 * number, SE3.exp(np.array(xi)), A @ A.T * 1e-6, 3 + number)


@pytest.fixture
def markers() -> MarkerMap:
    return MarkerMap.of(
        [mapped(7, 1.0, 2.0, 0.3, 0.1, -1.2, 2.0), mapped(3, -1.0, 0.2, 0.5, 1.5, 0.4, 0.3)], DICTIONARY, SE3.exp(np.full(6, 0.1))
    )


def assert_same(a: MarkerMap, b: MarkerMap) -> None:
    assert list(a.markers) == list(b.markers)
    for x, y in zip(a.markers.values(), b.markers.values(), strict=True):
        np.testing.assert_allclose(x.corners, y.corners, atol=1e-7)


def test_our_file_gives_everything_back(markers: MarkerMap, tmp_path: Path) -> None:
    write_marker_map(tmp_path / "m.yaml", markers)
    read = read_marker_map(tmp_path / "m.yaml")
    assert_same(read, markers)
    assert (read.dictionary, [m.sightings for m in read.markers.values()]) == (DICTIONARY, [6, 10])
    np.testing.assert_allclose(read.markers[7].covariance, markers.markers[7].covariance)
    assert read.T_base_camera is not None
    assert markers.T_base_camera is not None
    np.testing.assert_allclose(read.T_base_camera.matrix(), markers.T_base_camera.matrix(), atol=1e-12)


@pytest.mark.parametrize("read", [read_aruco_map, read_marker_map])
def test_arucos_file_gives_corners_and_dictionary_back(markers: MarkerMap, tmp_path: Path, read) -> None:
    write_aruco_map(tmp_path / "a.yml", markers)
    again = read(tmp_path / "a.yml")
    assert_same(again, markers)
    assert again.dictionary == DICTIONARY
    assert again.markers[7].size == pytest.approx(0.17)


ARUCO = """%YAML:1.0
---
aruco_bc_dict: ARUCO_MIP_36h12
aruco_bc_nmarkers: 1
aruco_bc_mInfoType: 1
aruco_bc_markers:
   - { id:5, corners:[ [ -5.0e-02, 5.0e-02, 0. ], [ 5.0e-02, 5.0e-02, 0. ], [ 5.0e-02, -5.0e-02, 0. ], [ -5.0e-02, -5.0e-02, 0. ] ] }
"""


def test_a_file_of_marker_mapper_is_read(tmp_path: Path) -> None:
    (tmp_path / "a.yml").write_text(ARUCO)
    (marker,) = read_marker_map(tmp_path / "a.yml").markers.values()
    np.testing.assert_allclose(marker.T_map_marker.matrix(), np.eye(4), atol=1e-9)
    assert (marker.id, marker.size) == (5, pytest.approx(0.1))


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "has no line"),
        ("a: [", "is no YAML"),
        ("format: bricktwin marker map 1\n", "missing"),
        (ARUCO.replace("InfoType: 1", "InfoType: 0"), "in pixels"),
        (ARUCO.replace("aruco_bc_markers", "others"), "has no `aruco_bc_markers`"),
        (ARUCO.replace("[ 5.0e-02, 5.0e-02, 0. ]", "[ 9.0e-02, 5.0e-02, 0. ]"), "no square"),
    ],
)
def test_a_file_that_is_none_is_named_with_its_fault(tmp_path: Path, text: str, problem: str) -> None:
    (tmp_path / "m.yaml").write_text(text)
    with pytest.raises(MarkerMapFileError, match=problem):
        read_marker_map(tmp_path / "m.yaml")
    with pytest.raises(MarkerMapFileError, match="cannot be read"):
        read_marker_map(tmp_path / "none.yaml")


def test_a_map_is_anchored_at_a_marker_or_at_the_robot(markers: MarkerMap) -> None:
    between = markers.markers[3].T_map_marker.inverse() @ markers.markers[7].T_map_marker
    first = markers.anchored(3, SE3())
    np.testing.assert_allclose(first.markers[3].T_map_marker.matrix(), np.eye(4), atol=1e-12)
    np.testing.assert_allclose(first.markers[7].T_map_marker.matrix(), between.matrix(), atol=1e-12)
    before, after = SE2(1.0, 2.0, 0.3), SE2(-1.0, 0.5, -0.7)
    robot = markers.anchored_to_robot(before, after)
    seen = SE3.from_se2(before).inverse() @ markers.markers[7].T_map_marker
    np.testing.assert_allclose((SE3.from_se2(after) @ seen).matrix(), robot.markers[7].T_map_marker.matrix(), atol=1e-12)
    turned = first.markers[7].covariance
    assert np.trace(turned) == pytest.approx(np.trace(markers.markers[7].covariance))


def test_what_does_not_fit_is_said(markers: MarkerMap) -> None:
    with pytest.raises(MarkerMapError, match="marker 3 is in the map twice"):
        MarkerMap.of([mapped(3, *np.zeros(6)), mapped(3, *np.ones(6))], DICTIONARY)
    with pytest.raises(MarkerMapError, match="no marker 4 in the map; there are 3, 7"):
        markers.anchored(4, SE3())
    markers.require_dictionary(["ARUCO_MIP_36h12"])
    with pytest.raises(MarkerMapError, match="of dictionary DICT_ARUCO_MIP_36h12, the markers looked for are of 4X4_50"):
        markers.require_dictionary(["DICT_4X4_50"])
