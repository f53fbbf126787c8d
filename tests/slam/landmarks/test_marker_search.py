"""Our own search for markers, against SciPy and OpenCV."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from slam.errors import ParameterError
from slam.kernels.darker import SIDE, darker_than_around
from slam.kernels.marker_bits import read_markers
from slam.kernels.outlines import four_sided
from slam.kernels.regions import first_pixels
from slam.landmarks.marker_family import MarkerFamily
from slam.landmarks.marker_search import OpenCvSearch, OwnSearch, Tolerance
from slam.landmarks.markers import Markers
from slam.messages import CameraInfo

MIP = "DICT_ARUCO_MIP_36h12"
TOLERANCE = Tolerance(0.3, 12.0, 8.0)
PLACE = np.array([[80.0, 60.0], [150.0, 70.0], [140.0, 145.0], [75.0, 130.0]])
Grey = NDArray[np.uint8]


def picture(
    number: int, dictionary: str = "DICT_ARUCO_MIP_36h12", place: NDArray[np.float64] = PLACE, flipped: tuple[int, ...] = ()
) -> Grey:
    """A marker of 20 on 200 before 150, some of its bits wrong."""
    family = MarkerFamily(dictionary).load()
    modules = family.markerSize + 2
    cells = np.pad(cv2.aruco.generateImageMarker(family, number, modules), 1, constant_values=255)
    for bit in flipped:
        row, column = divmod(bit, family.markerSize)
        cells[row + 2, column + 2] = 255 - cells[row + 2, column + 2]
    fine = 16
    drawn = np.kron(np.where(cells > 0, 200, 20), np.ones((fine, fine))).astype(np.float32)
    inner = np.array([[1, 1], [modules + 1, 1], [modules + 1, modules + 1], [1, modules + 1]]) * fine - 0.5
    H = cv2.getPerspectiveTransform(inner.astype(np.float32), (4.0 * place + 1.5).astype(np.float32))
    large = cv2.warpPerspective(drawn, H, (1280, 960), borderValue=150.0)
    return np.rint(cv2.resize(large, (320, 240), interpolation=cv2.INTER_AREA)).astype(np.uint8)


def search(dictionary: str = MIP, *, quick: bool = True) -> OwnSearch:
    return OwnSearch((MarkerFamily(dictionary),), TOLERANCE, quick=quick)


def test_dark_is_what_is_darker_than_the_mean_about() -> None:
    grey = np.random.default_rng(0).integers(0, 256, (61, 83)).astype(np.uint8)
    around = ndimage.uniform_filter(grey.astype(np.float64), SIDE, mode="nearest")
    dark = darker_than_around(grey, 0.25, 20.0)
    assert dark.shape[1] % 8 == 0
    assert not np.delete(dark, np.s_[1:62], axis=0).any()
    assert not np.delete(dark, np.s_[1:84], axis=1).any()
    clear = (abs(grey - 0.75 * around) > 1e-3) & (abs(grey + 20.0 - around) > 1e-3)
    np.testing.assert_array_equal(dark[1:62, 1:84][clear], ((grey < 0.75 * around) & (grey + 20.0 < around))[clear])


@pytest.mark.parametrize("share", [0.1, 0.4, 0.6])
def test_regions_are_those_of_scipy(share: float) -> None:
    dark = np.zeros((52, 64), np.uint8)
    dark[1:-1, 1:60] = np.random.default_rng(1).random((50, 59)) < share
    labels, count = ndimage.label(dark, np.ones((3, 3)))
    firsts = [tuple(np.argwhere(labels == k)[0]) for k in range(1, count + 1)]
    sizes = [np.ptp(np.argwhere(labels == k), axis=0).max() + 1 for k in range(1, count + 1)]
    assert sorted(map(tuple, first_pixels(dark, 4.0).tolist())) == sorted(f for f, size in zip(firsts, sizes, strict=True) if size >= 4)


@pytest.mark.parametrize("seed", range(20))
def test_a_tilted_square_is_cut_at_its_corners(seed: int) -> None:
    rng = np.random.default_rng(seed)
    corners = np.array([[60, 50], [120, 50], [120, 110], [60, 110]]) + rng.uniform(-14, 14, (4, 2))
    dark = np.zeros((200, 200), np.uint8)
    cv2.fillConvexPoly(dark, np.rint(corners * 16).astype(np.int32) + 16, 1, shift=4)
    (found,) = four_sided(dark, 198, 12.0)
    away = np.linalg.norm(found[:, None] - corners[None], axis=2)
    assert away.min(axis=1).max() < 1.5
    assert sorted(away.argmin(axis=1)) == [0, 1, 2, 3]
    (ux, uy), (vx, vy) = (found[1] - found[0]), (found[2] - found[1])
    assert ux * vy - uy * vx > 0.0  # clockwise, as rows go down


@pytest.mark.parametrize("sides", [3, 5, 6, 40])
def test_what_has_not_four_sides_is_none(sides: int) -> None:
    angle = 0.3 + 2.0 * np.pi * np.arange(sides) / sides
    dark = np.zeros((200, 200), np.uint8)
    cv2.fillConvexPoly(dark, np.rint(100 + 40 * np.column_stack([np.cos(angle), np.sin(angle)])).astype(np.int32), 1)
    assert len(four_sided(dark, 198, 12.0)) == 0


def test_what_touches_the_edge_or_is_a_speck_or_has_a_dent_is_none() -> None:
    dark = np.zeros((120, 128), np.uint8)
    dark[1:40, 40:80] = 1
    dark[60, 60] = dark[60, 70] = 1
    dark[70:110, 20:60] = 1
    dark[70:95, 35:45] = 0
    assert len(four_sided(dark, 118, 1.0)) == 0


@pytest.mark.parametrize("dictionary", [MIP, "DICT_4X4_50", "DICT_7X7_50", "DICT_APRILTAG_36h11", "DICT_ARUCO_ORIGINAL"])
@pytest.mark.parametrize("turn", range(4))
def test_every_marker_and_its_first_corner_are_as_opencv_finds_them(dictionary: str, turn: int) -> None:
    ours, theirs = search(dictionary), OpenCvSearch((MarkerFamily(dictionary),), TOLERANCE, "none")
    for number in (0, 7, 23, 49 if dictionary.endswith("50") else 199):
        grey = picture(number, dictionary, np.roll(PLACE, turn, axis=0))
        found, expected = ours.find(grey), theirs.find(grey)
        assert found.numbers.tolist() == expected.numbers.tolist() == [number]
        assert np.abs(found.corners - expected.corners).max() < 2.0
        assert np.abs(found.corners[0] - np.roll(PLACE, turn, axis=0)).max() < 0.7


def test_as_many_bits_are_put_right_as_asked() -> None:
    assert search().find(picture(5, flipped=(14,))).numbers.tolist() == [5]
    two = search().find(picture(5, flipped=(14, 20)))
    assert (two.numbers.tolist(), two.undecoded) == ([], 1)
    strict = OwnSearch((MarkerFamily(),), Tolerance(0.0, 12.0, 8.0), quick=True)
    assert strict.find(picture(5, flipped=(14,))).numbers.tolist() == []


def test_a_pale_marker_and_one_of_another_dictionary_are_not_read() -> None:
    code = np.zeros((1, 4), np.uint64)
    flat = np.full((240, 320), 90, np.uint8)
    assert read_markers(flat, PLACE[None], code, 8, (8.0, 2, 1)).tolist() == [[-1, -1]]
    assert search("DICT_6X6_250").find(picture(5)).numbers.tolist() == []


@pytest.mark.parametrize("light", [0.5, 0.1])
def test_the_light_does_not_matter(light: float) -> None:
    dim = np.rint(light * picture(5) + np.linspace(0.0, 5.0, 320)).astype(np.uint8)
    assert search().find(dim).numbers.tolist() == [5]


def test_pale_and_soft_markers_are_found_when_there_is_time() -> None:
    pale = np.rint(140.0 + 0.09 * picture(5)).astype(np.uint8)
    soft = cv2.GaussianBlur(cv2.resize(picture(5), None, fx=6.0, fy=6.0, interpolation=cv2.INTER_CUBIC), (0, 0), 9.0)
    beside = np.concatenate([cv2.resize(picture(8), None, fx=6.0, fy=6.0), soft], axis=1)
    assert search(quick=False).find(pale).numbers.tolist() == [5]
    assert search().find(beside).numbers.tolist() == [8]
    both = search(quick=False).find(beside)
    assert sorted(both.numbers.tolist()) == [5, 8]
    place = 6.0 * PLACE + 2.5 + [1920.0, 0.0]
    assert np.abs(both.corners[both.numbers == 5][0] - place).max() < 12.0
    fitted = Markers().build().detect(beside, CameraInfo(3840, 1440, np.diag([1000.0, 1000.0, 1.0]), np.zeros(5))).sightings
    assert [s.id for s in fitted] == [5, 8]
    assert np.abs(fitted[0].pixels - place).max() < 1.2


def test_what_is_seen_by_several_looks_counts_once() -> None:
    found = search(quick=False).find(picture(5))
    assert found.numbers.tolist() == [5]


def test_noise_and_clouds_hold_nothing() -> None:
    rng, look = np.random.default_rng(0), search(quick=False)
    for _ in range(300):
        clouds = cv2.GaussianBlur(rng.uniform(0.0, 255.0, tuple(rng.integers(20, 200, 2))), (0, 0), rng.uniform(0.3, 4.0))
        clouds = 255.0 * (clouds - clouds.min()) / (clouds.max() - clouds.min())
        found = look.find(clouds.astype(np.uint8))
        assert np.isfinite(found.corners).all()
        assert found.numbers.tolist() == []


def test_corners_that_make_no_square_are_not_read() -> None:
    grey, codes = picture(5), np.zeros((1, 4), np.uint64)
    for corners in (np.zeros((1, 4, 2)), np.full((1, 4, 2), np.nan), np.array([[[0.0, 0.0], [9.0, 9.0], [0.0, 0.0], [9.0, 9.0]]])):
        assert read_markers(grey, corners, codes, 8, (8.0, 2, 1)).tolist() == [[-1, -1]]


def test_a_dictionary_of_too_many_bits_is_refused(tmp_path) -> None:
    file = tmp_path / "large.yml"
    large = cv2.aruco.extendDictionary(2, 9)
    storage = cv2.FileStorage(str(file), cv2.FILE_STORAGE_WRITE)
    large.writeDictionary(storage)
    storage.release()
    with pytest.raises(ParameterError, match="64 bits"):
        search(str(file))
