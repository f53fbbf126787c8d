from dataclasses import replace

import numpy as np
import pytest

from hardware.spec import RobotSpec
from sim.camera_errors import DATASHEET, CameraErrors
from sim.film import Film, Stereo
from sim.living import Living
from sim.painters import PAINTERS
from sim.raster.kernels import film as kernels
from sim.scenery import Scenery
from slam.se3 import SE3
from worlds.parts import Box, Wall
from worlds.world import World

CAMERA = RobotSpec().require_camera()
LEVEL = SE3(np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), np.array([0.0, 0.0, 15.0]))
"""A camera that looks along x, 15 m above the floor."""


def before(distance, boxes=(), material="matte"):
    """What a camera sees before a large wall, with what else is there."""
    wall = Wall((distance + 0.05, -20.0), (distance + 0.05, 20.0), 0.1, 30.0, material)
    world = World(name="wall", walls=(wall,), start=(-1.0, 0.0, 0.0), boxes=boxes)
    scenery = Scenery(world, Living(world))
    return scenery, PAINTERS["raster"](scenery), scenery.views_of(LEVEL)


def depth_images(distance, errors, count=1, **contents):
    scenery, painter, views = before(distance, **contents)
    stereo = Stereo(CAMERA, errors, scenery.faces, np.random.default_rng(1))
    return [stereo.measure(painter, views, stereo.draw()) for _ in range(count)]


@pytest.mark.parametrize("distance", [0.5, 1.0, 2.0, 3.0, 4.0])
def test_depth_errs_as_the_stereo_formula_says(distance):
    errors = CameraErrors(subpixel=DATASHEET.subpixel, patch=DATASHEET.patch, disparity_steps=DATASHEET.disparity_steps)
    rms = np.sqrt(np.nanmean(np.square(np.array(depth_images(distance, errors, 4)) - distance)))
    assert rms == pytest.approx(distance**2 * errors.subpixel / (CAMERA.depth.focal[0] * CAMERA.baseline), rel=0.1)


def test_what_the_right_imager_cannot_see_has_no_depth():
    post = Box((1.0, 0.0), (0.1, 0.2, 3.0), z=13.5)
    (depth,) = depth_images(3.0, CameraErrors(occlusion=1.0), boxes=(post,))
    row = depth[240]
    edge = int(np.flatnonzero(row < 1.5)[0])
    hole = CAMERA.depth.focal[0] * CAMERA.baseline * (1.0 / 0.95 - 1.0 / 3.0)
    assert np.isnan(row[edge - round(hole) + 2 : edge]).all()
    assert np.isfinite(row[edge - round(hole) - 5 : edge - round(hole) - 2]).all()
    assert np.isfinite(row[np.flatnonzero(row < 1.5)[-1] + 1 : 800]).all()


def test_the_left_edge_has_no_depth():
    (depth,) = depth_images(2.0, CameraErrors(occlusion=1.0))
    band = CAMERA.depth.focal[0] * CAMERA.baseline / 2.0
    assert np.isnan(depth[:, : int(band)]).all()
    assert np.isfinite(depth[:, int(band) + 2 :]).all()


@pytest.mark.parametrize(("distance", "seen"), [(0.19, False), (0.2, True)])
def test_nothing_nearer_than_the_nearest_depth_is_measured(distance, seen):
    (depth,) = depth_images(distance, CameraErrors())
    assert np.isfinite(depth).all() == seen


def test_nothing_farther_than_the_farthest_depth_is_measured():
    (depth,) = depth_images(4.0, CameraErrors(range_max=3.9))
    assert np.isnan(depth).all()


@pytest.mark.parametrize("material", ["dark", "glossy", "glass"])
def test_difficult_surfaces_lose_their_share(material):
    share = getattr(DATASHEET, f"lost_{material}")
    images = depth_images(2.0, replace(DATASHEET, occlusion=0.0), 8, material=material)
    assert np.mean(np.isnan(images)) == pytest.approx(share, abs=0.03)


def test_colours_have_the_noise_of_their_errors():
    scenery, painter, views = before(2.0)
    errors = CameraErrors(read_noise=2.0, shot_noise=0.05)
    film = Film(CAMERA.colour, errors, scenery.faces, np.random.default_rng(0))
    clean = painter.colours(CAMERA.colour, views, painter.see(CAMERA.colour, views), 1.0)
    image = film.expose(painter, (views, views), 1.0, film.draw())
    expected = np.sqrt(np.mean(4.0 + 0.05 * clean) + 1.0 / 12.0)
    assert np.std(image - clean) == pytest.approx(expected, rel=0.03)


def test_noise_goes_on_from_image_to_image():
    scenery, painter, views = before(2.0)
    film = Film(CAMERA.colour, CameraErrors(read_noise=2.0), scenery.faces, np.random.default_rng(0))
    first, second = (film.expose(painter, (views, views), 1.0, film.draw()) for _ in range(2))
    assert np.mean(first != second) > 0.5


def turned_by(pixels):
    """Blur of a bright column while the camera turns so that it goes by so many pixels."""
    picture = np.zeros((9, 81, 3), np.float32)
    picture[:, 40] = 210.0
    angle = pixels / 100.0
    turned = np.array([[1.0, 0.0, angle], [0.0, 1.0, 0.0], [-angle, 0.0, 1.0]])
    views = np.stack([np.eye(3), turned])[None], np.zeros((1, 2, 3))
    x, y = np.meshgrid((np.arange(81) - 40) / 100.0, (np.arange(9) - 4) / 100.0)
    rays = x.astype(np.float32), y.astype(np.float32)
    nowhere = np.zeros((0, 4, 3)), np.zeros((0, 4)), np.zeros(0, np.int32), np.zeros(0, np.float32)
    grain = np.zeros(243, np.float32), np.zeros(9, np.int64), 0.0, 0.0
    scene = np.full((9, 81), -1, np.int32), nowhere, views
    return kernels.develop_blurred(picture, scene, rays, 100.0, grain)[4, :, 0].astype(float)


@pytest.mark.parametrize("pixels", [3.0, 5.0, 7.0])
def test_motion_smears_evenly_over_its_way(pixels):
    row = turned_by(pixels)
    half = int(pixels) // 2
    np.testing.assert_allclose(row[40 - half : 41 + half], 210.0 / pixels, rtol=0.02)
    assert row.sum() == pytest.approx(210.0, rel=0.02)


def test_motion_below_a_pixel_does_not_show():
    row = turned_by(0.9)
    assert row[40] == 210.0
    assert row.sum() == 210.0
