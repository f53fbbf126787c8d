"""Markers in pictures: drawn here through a known camera, and photographed."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from slam.errors import ParameterError
from slam.kernels.corner_fit import fit_corners
from slam.kernels.lens import to_pixel, to_ray
from slam.kernels.planar_pose import square_poses
from slam.kernels.rolling_shutter import read_at_once
from slam.landmarks.marker_family import MarkerFamily
from slam.landmarks.markers import MarkerImageError, Markers
from slam.landmarks.sighting import Sighting, square
from slam.messages import CameraInfo
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3

K = np.array([[400.0, 0.0, 160.5], [0.0, 400.0, 119.5], [0.0, 0.0, 1.0]])
PLAIN = CameraInfo(320, 240, K, np.zeros(5))
BENT = CameraInfo(320, 240, K, np.array([-0.25, 0.08, 0.001, -0.002, 0.0]))
FACING = SE3(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 0.0]))
SIZE, ID = 0.12, 17


def posed(x: float = 0.02, y: float = -0.01, z: float = 0.6, tilt: float = 0.5, turn: float = 0.2) -> SE3:
    """`T_camera_marker`."""
    return SE3.from_xyz_rpy((x, y, z), (0.3 * tilt, tilt, turn)) @ FACING


def drawn(markers: list[tuple[int, SE3]], camera: CameraInfo = PLAIN, blur: float = 0.6, noise: float = 0.0) -> NDArray[np.uint8]:
    """A picture, 4 x 4 samples to a pixel."""
    n, dictionary = 4, cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_ARUCO_MIP_36h12)
    grid = (np.arange(camera.width * n) + 0.5) / n - 0.5, (np.arange(camera.height * n) + 0.5) / n - 0.5
    u, v = np.meshgrid(*grid)
    x, y = (u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1]
    if camera.D.any():
        x, y = unbent(x, y, camera)
    picture = np.full(x.shape, 170.0)
    for number, T in markers:
        cells = cv2.aruco.generateImageMarker(dictionary, number, 8).astype(np.float64)
        cells = 20.0 + 200.0 * np.pad(cells, 1, constant_values=255.0) / 255.0
        normal = T.R[:, 2]
        depth = normal @ T.t / (normal[0] * x + normal[1] * y + normal[2])
        hit = np.stack([x * depth, y * depth, depth], axis=-1) - T.t
        column = np.floor(((hit @ T.R[:, 0]) / SIZE + 0.5) * 8.0).astype(int) + 1
        row = np.floor((0.5 - (hit @ T.R[:, 1]) / SIZE) * 8.0).astype(int) + 1
        inside = (column >= 0) & (column < 10) & (row >= 0) & (row < 10) & (depth > 0.0)
        picture[inside] = cells[row[inside], column[inside]]
    small = picture.reshape(camera.height, n, camera.width, n).mean(axis=(1, 3))
    small = cv2.GaussianBlur(small, (0, 0), blur) if blur > 0.0 else small
    small = small + np.random.default_rng(0).normal(0.0, noise, small.shape)
    return np.clip(np.rint(small), 0, 255).astype(np.uint8)


def unbent(x: FloatArray, y: FloatArray, camera: CameraInfo) -> tuple[FloatArray, FloatArray]:
    k1, k2, p1, p2, k3 = camera.D
    u, v = x.copy(), y.copy()
    for _ in range(12):
        r2 = u * u + v * v
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        u, v = (x - 2 * p1 * u * v - p2 * (r2 + 2 * u * u)) / radial, (y - p1 * (r2 + 2 * v * v) - 2 * p2 * u * v) / radial
    return u, v


def rays_of(T: SE3) -> FloatArray:
    corners = T.transform(square(SIZE))
    return corners[:, :2] / corners[:, 2:]


@pytest.mark.parametrize("camera", [PLAIN, BENT], ids=["plain lens", "bent lens"])
@pytest.mark.parametrize(("tilt", "noise", "limit"), [(0.1, 0.0, 0.05), (0.9, 0.0, 0.06), (0.5, 3.0, 0.12)])
def test_corners_are_right_to_a_small_part_of_a_pixel(camera: CameraInfo, tilt: float, noise: float, limit: float) -> None:
    T = posed(tilt=tilt)
    (sighting,) = Markers().build().detect(drawn([(ID, T)], camera, noise=noise), camera).sightings
    assert sighting.id == ID
    assert np.sqrt(np.mean(((sighting.rays - rays_of(T)) * 400.0) ** 2)) < limit


def test_lines_beat_opencv_and_lie_to_no_side() -> None:
    T = posed(tilt=0.6)
    picture = drawn([(ID, T)])
    rms = {}
    for method in ("lines", "none", "subpix", "contour", "apriltag"):
        (sighting,) = Markers(corners=method).build().detect(picture, PLAIN).sightings  # type: ignore[arg-type]
        off = (sighting.rays - rays_of(T)) * 400.0
        rms[method] = float(np.sqrt(np.mean(off**2)))
    assert rms["lines"] < 0.3 * min(value for method, value in rms.items() if method != "lines")


def test_a_blur_of_five_pixels_is_measured_and_does_no_harm() -> None:
    T = posed(z=0.5, tilt=0.2)
    sharp = drawn([(ID, T)], blur=0.6).astype(np.float64)
    moved = np.mean([np.roll(sharp, k, axis=1) for k in (-2, -1, 0, 1, 2)], axis=0)
    (sighting,) = Markers().build().detect(np.rint(moved).astype(np.uint8), PLAIN).sightings
    assert sighting.blur > 1.2
    assert np.abs((sighting.rays - rays_of(T)) * 400.0).max() < 0.15


def test_both_poses_are_kept_and_one_is_true() -> None:
    T = posed(z=1.0, tilt=0.6)
    (sighting,) = Markers().build().detect(drawn([(ID, T)]), PLAIN).sightings
    near = min(sighting.branches, key=lambda branch: float(np.linalg.norm(branch.R - T.R)))
    assert near is sighting.branches[0]
    assert np.linalg.norm(near.t - T.t) < 0.003
    assert np.linalg.norm(SE3(near.R.T @ T.R).log()) < 0.01
    assert sighting.chi2[0] < sighting.chi2[1]


@pytest.mark.parametrize("seed", range(8))
def test_exact_corners_give_the_exact_pose_as_one_branch(seed: int) -> None:
    rng = np.random.default_rng(seed)
    T = posed(*rng.uniform(-0.3, 0.3, 2), rng.uniform(0.4, 3.0), *rng.uniform(-1.0, 1.0, 2))
    R, t, chi = square_poses(rays_of(T)[None], np.tile(np.eye(2) * 1e6, (1, 4, 1, 1)), np.array([SIZE]))
    np.testing.assert_allclose(R[0, 0], T.R, atol=1e-5)
    np.testing.assert_allclose(t[0, 0], T.t, atol=1e-5)
    assert chi[0, 0] < 1e-6 <= chi[0, 1]
    _, rotations, translations, _ = cv2.solvePnPGeneric(
        square(SIZE), rays_of(T).copy(), np.eye(3), np.zeros(5), flags=cv2.SOLVEPNP_IPPE_SQUARE, rvec=np.zeros(3), tvec=np.zeros(3)
    )
    np.testing.assert_allclose(np.ravel(translations[0]), t[0, 0], atol=1e-4)
    np.testing.assert_allclose(cv2.Rodrigues(rotations[0])[0], R[0, 0], atol=1e-3)


def test_the_stated_covariance_covers_the_error() -> None:
    T, square_errors = posed(tilt=0.6), []
    detector = Markers().build()
    clean = drawn([(ID, T)]).astype(np.float64)
    for seed in range(30):
        noisy = clean + np.random.default_rng(seed).normal(0.0, 4.0, clean.shape)
        (sighting,) = detector.detect(np.clip(np.rint(noisy), 0, 255).astype(np.uint8), PLAIN).sightings
        off = sighting.rays - rays_of(T)
        square_errors.append(np.einsum("ki,kij,kj->k", off, sighting.weights, off).mean() / 2.0)
    assert 0.2 < np.mean(square_errors) < 2.5


def worst_deviations(sighting: Sighting, T: SE3) -> float:
    """Chi-square of all corners against the truth; 8 on average where the covariance is true."""
    off = sighting.rays - rays_of(T)
    return float(np.einsum("ki,kij,kj->", off, sighting.weights, off))


@pytest.mark.parametrize("number", [3, 17, 28, 41])
@pytest.mark.parametrize(("tilt", "z"), [(1.0, 1.1), (1.1, 0.9), (0.9, 1.4)])
def test_a_narrow_module_beside_a_white_one_is_not_trusted_too_much(number: int, tilt: float, z: float) -> None:
    T = posed(0.0, 0.0, z, tilt)
    for sighting in Markers().build().detect(drawn([(number, T)]), PLAIN).sightings:
        assert worst_deviations(sighting, T) < 40.0


@pytest.mark.parametrize("left", [0.0, 1.0, 2.0])
@pytest.mark.parametrize("grey", [90, 140])
def test_a_thing_before_the_margin_does_not_deceive(left: float, grey: int) -> None:
    T = posed()
    top, *_, bottom = rays_of(T) * 400.0 + K[:2, 2]
    along = (bottom - top) / np.linalg.norm(bottom - top)
    v, u = np.mgrid[:240, :320]
    picture = drawn([(ID, T)])
    picture[(u - top[0]) * along[1] - (v - top[1]) * along[0] < -left] = grey
    for sighting in Markers().build().detect(picture, PLAIN).sightings:
        assert worst_deviations(sighting, T) < 40.0


def test_rows_that_are_read_later_are_carried_back() -> None:
    T, mount, twist = posed(), SE3.from_xyz_rpy((0.1, 0.0, 0.2), (-1.6, 0.05, -1.5)), np.array([0.3, 0.0, 0.8])
    delays = np.array([-0.008, -0.003, 0.004, 0.008])
    seen = np.empty((4, 2))
    for k, delay in enumerate(delays):
        T_then = mount.inverse() @ SE3.from_se2(SE2.exp(twist * delay)).inverse() @ mount @ T
        seen[k] = rays_of(T_then)[k]
    pose, lever = (np.array(T.R)[None], np.array(T.t)[None]), (np.array(mount.R), np.array(mount.t))
    still = read_at_once(seen[None], pose, lever, twist, delays[None])[0]
    assert np.abs(seen - rays_of(T)).max() > 0.005
    assert np.abs(still - rays_of(T)).max() < 1e-4


def test_lens_and_its_inverse_agree_with_opencv() -> None:
    lens = (400.0, 400.0, 160.5, 119.5, np.array(BENT.D))
    for x, y in ((0.3, -0.2), (-0.35, 0.25), (0.0, 0.0)):
        u, v = to_pixel(lens, x, y)
        expected = cv2.projectPoints(np.array([[x, y, 1.0]]), np.zeros(3), np.zeros(3), K, np.array(BENT.D))[0].ravel()
        np.testing.assert_allclose((u, v), expected, atol=1e-9)
        np.testing.assert_allclose(to_ray(lens, u, v), (x, y), atol=1e-8)


def test_what_is_not_used_is_counted() -> None:
    twins = [(ID, posed(x=-0.12, tilt=0.0)), (ID, posed(x=0.12, tilt=0.0))]
    detection = Markers().build().detect(drawn(twins), PLAIN)
    assert (detection.sightings, detection.rejected["twice"]) == ((), 2)
    small = Markers(least_side=100.0).build().detect(drawn([(ID, posed())]), PLAIN)
    assert (small.sightings, small.rejected["too small"]) == ((), 1)
    mirrored = Markers().build().detect(drawn([(ID, posed())])[:, ::-1].copy(), PLAIN)
    assert mirrored.sightings == ()
    assert mirrored.rejected["not decoded"] > 0


def test_a_side_that_cannot_be_seen_is_no_corner() -> None:
    grey = np.full((60, 60), 128, np.uint8)
    rays, _, _, quality = fit_corners(
        grey, np.array([[[20.0, 20.0], [40.0, 20.0], [40.0, 40.0], [20.0, 40.0]]]), np.array([8.0]), (400.0, 400.0, 30.0, 30.0, np.zeros(5))
    )
    assert np.isnan(rays).all()
    assert np.isnan(quality).all()


@pytest.mark.parametrize("shape", [(240, 320), (240, 320, 3)])
def test_a_black_image_shows_nothing(shape: tuple[int, ...]) -> None:
    assert Markers().build().detect(np.zeros(shape, np.uint8), PLAIN).sightings == ()


def test_a_camera_that_does_not_fit_is_refused_with_the_ratio() -> None:
    detector = Markers().build()
    with pytest.raises(MarkerImageError, match=r"320 x 240, its K is for 640 x 480: 0\.5 times"):
        detector.detect(drawn([]), dataclasses.replace(PLAIN, width=640, height=480))
    with pytest.raises(MarkerImageError, match="no K"):
        detector.detect(drawn([]), dataclasses.replace(PLAIN, K=np.zeros((3, 3))))


def test_sizes_and_first_ids_go_by_dictionary() -> None:
    families = (MarkerFamily("DICT_4X4_50", 0.05, first=1000), MarkerFamily(sizes={str(ID): 0.24}))
    (sighting,) = Markers(families=families).build().detect(drawn([(ID, posed())]), PLAIN).sightings
    assert (sighting.id, sighting.size) == (ID, 0.24)
    assert sighting.branches[0].t[2] == pytest.approx(1.2, rel=0.01)
    with pytest.raises(ParameterError, match="dictionary"):
        MarkerFamily("DICT_5X5_7").load()


@pytest.mark.parametrize("quick", [False, True])
def test_the_photograph_of_six_markers_shows_six(shared_data: Path, quick: bool) -> None:
    detection = photographed(shared_data / "aruco" / "singlemarkersoriginal.jpg", Markers((MarkerFamily("DICT_6X6_250"),), quick=quick))
    assert [s.id for s in detection.sightings] == [23, 40, 62, 98, 124, 203]


def test_the_photographs_of_boards_show_all_markers(shared_data: Path) -> None:
    folder = shared_data / "aruco"
    board = photographed(folder / "gboriginal.png", Markers((MarkerFamily(str(folder / "tutorial_dict.yml"), 0.04),)))
    assert [s.id for s in board.sightings] == list(range(35))
    for name in ("choriginal.jpg", "img_00.jpg", "img_01.jpg", "img_02.jpg", "img_03.jpg"):
        chessboard = photographed(folder / name, Markers((MarkerFamily("DICT_6X6_250", 0.02),)))
        assert [s.id for s in chessboard.sightings] == list(range(17))


def photographed(path: Path, markers: Markers):
    picture = cv2.cvtColor(cv2.imread(str(path)), cv2.COLOR_BGR2RGB)
    height, width = picture.shape[:2]
    camera = CameraInfo(width, height, np.array([[650.0, 0.0, width / 2], [0.0, 650.0, height / 2], [0.0, 0.0, 1.0]]), np.zeros(5))
    return markers.build().detect(picture, camera)


def test_an_upright_marker_ahead_stands_upright() -> None:
    (sighting,) = Markers().build().detect(drawn([(ID, posed(0.0, 0.0, 0.6, 0.0, 0.0))]), PLAIN).sightings
    np.testing.assert_allclose(sighting.branches[0].R, FACING.R, atol=math.radians(3.0))
