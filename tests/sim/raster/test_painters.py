from dataclasses import replace

import numpy as np
import pytest

from hardware.camera_spec import CameraSpec, d435
from scripts.bench.corners import fitted_corners
from sim.camera_truth import seen_corners
from sim.painters import PAINTERS
from slam.se3 import SE3
from worlds.parts import Box, Poster

COLOUR, DEPTH = CameraSpec().colour, CameraSpec().depth
SMALL = d435((424, 240), (424, 240)).colour
BENT = replace(COLOUR, distortion=(0.12, -0.25, 0.001, -0.0008, 0.05))


@pytest.mark.parametrize("pose", [(0.2, -0.3, -0.9), (0.0, 0.6, 2.0), (-1.4, 0.1, 0.1), (1.9, -1.9, -0.7)])
def test_faces_and_depths_are_those_that_rays_find(markers, pose):
    views, exact = markers.view(*pose), PAINTERS["embree"](markers.scenery)
    ids, true_ids = (painter.see(DEPTH, views) for painter in (markers.painter, exact))
    assert np.mean(ids == true_ids) > 0.998
    depth, true_depth = markers.painter.depths(DEPTH, views, ids), exact.depths(DEPTH, views, true_ids)
    assert np.mean(np.abs(depth - true_depth) <= 0.001) > 0.998


@pytest.mark.parametrize("imager", [COLOUR, BENT], ids=["pinhole", "distorted"])
def test_marker_edges_are_where_they_are_projected(markers, imager):
    errors = []
    for pose in [(0.0, 0.5, 0.3), (0.5, -0.5, 1.9), (-0.5, 0.8, -2.2), (1.4, 1.0, 0.0), (-1.2, -1.0, 3.0), (0.6, -1.2, -1.2)]:
        views = markers.view(*pose)
        ids = markers.painter.see(imager, views)
        grey = np.rint(markers.painter.colours(imager, views, ids, 1.0)).astype(np.float64).mean(axis=2)
        for face, marker in markers.scenery.marker_faces(markers.world):
            corners = seen_corners(marker, face, imager, views, ids)
            if corners is not None and np.ptp(corners[:, 0]) > 15.0:
                errors.append(fitted_corners(grey, corners, imager) - corners)
    assert len(errors) > 20
    assert np.sqrt(np.mean(np.square(errors))) <= 0.03
    assert np.all(np.abs(np.mean(errors, axis=(0, 1))) <= 0.01)


def test_colours_are_those_of_tinyrenderer(markers):
    views = markers.view(0.0, 0.0, 0.3)
    ids = markers.painter.see(COLOUR, views)
    ours, theirs = (painter.colours(COLOUR, views, ids, 1.0) for painter in (markers.painter, PAINTERS["tiny"](markers.scenery)))
    assert 10.0 * np.log10(255.0**2 / np.mean(np.square(ours - theirs))) >= 25.0


def test_tinyrenderer_sees_the_same_depth(markers):
    views = markers.view(0.0, 0.0, 0.3)
    ids = markers.painter.see(SMALL, views)
    ours, theirs = (painter.depths(SMALL, views, ids) for painter in (markers.painter, PAINTERS["tiny"](markers.scenery)))
    assert np.median(np.abs(ours - theirs)) < 0.005


def test_a_face_that_reaches_behind_the_camera_is_drawn(studio, room):
    long_box = Box((0.0, -0.4), (3.6, 0.3, 0.15))
    place = studio(room(boxes=(long_box,), start=(0.0, 0.6, 0.0)))
    views = place.view(0.0, -0.05, 0.0)
    exact = PAINTERS["embree"](place.scenery)
    assert np.mean(place.painter.see(DEPTH, views) == exact.see(DEPTH, views)) > 0.998


def test_a_rolling_picture_of_a_still_scene_is_the_global_one(markers):
    views = markers.view(0.0, 0.0, 0.3)
    rolling = tuple(np.repeat(array, COLOUR.height, axis=1) for array in views)
    np.testing.assert_array_equal(markers.painter.see(COLOUR, rolling), markers.painter.see(COLOUR, views))


def test_a_dim_light_dims_everything(markers):
    views = markers.view(0.0, 0.0, 0.3)
    ids = markers.painter.see(SMALL, views)
    bright, dim = (markers.painter.colours(SMALL, views, ids, level) for level in (1.0, 0.5))
    np.testing.assert_allclose(dim, 0.5 * bright, atol=0.6)


def test_an_edge_mixes_what_shares_its_pixel(studio, room):
    place = studio(room(boxes=(Box((1.2, 0.0), (0.2, 0.5, 0.6), name="crate"),)))
    views = place.view(0.0, 0.0, 0.0)
    fine = replace(SMALL, width=4 * SMALL.width, height=4 * SMALL.height, focal=tuple(4 * f for f in SMALL.focal),
                   centre=tuple(4 * c + 1.5 for c in SMALL.centre))  # fmt: skip
    exact = place.painter.colours(fine, views, place.painter.see(fine, views), 1.0)
    exact = exact.reshape(SMALL.height, 4, SMALL.width, 4, 3).mean(axis=(1, 3))
    picture = place.painter.colours(SMALL, views, place.painter.see(SMALL, views), 1.0)
    assert np.sqrt(np.mean(np.square(picture - exact))) < 3.0


def test_a_poster_is_seen_upright(studio, room):
    world = room()
    poster = Poster((1.999, 0.0, 0.5), np.pi, (0.6, 0.8), seed=3)
    place = studio(type(world)(name="room", walls=world.walls, start=world.start, posters=(poster,)))
    level = SE3(np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), np.array([0.8, 0.0, 0.5]))
    views = place.scenery.views_of(level)
    picture = place.painter.colours(COLOUR, views, place.painter.see(COLOUR, views), 1.0)
    cells = place.scenery.faces.prints[0].astype(float)
    left, top = (np.array([-0.3, -0.4]) / 1.199 * 612.0 + COLOUR.centre).astype(int)
    seen = picture[top + 8 : top + 400, left + 8 : left + 300]
    rows, columns = (np.arange(8, 8 + n) * 160 // 408 for n in seen.shape[:2])
    assert np.corrcoef(seen.ravel(), cells[np.ix_(rows, columns)].ravel())[0, 1] > 0.9
