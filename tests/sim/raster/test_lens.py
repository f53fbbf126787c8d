from dataclasses import replace

import cv2
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hardware.camera_spec import CameraSpec
from sim.raster.lens import distorted, lens_of, project, undistorted

IMAGER = replace(CameraSpec().colour, distortion=(0.12, -0.25, 0.001, -0.0008, 0.05))
places = st.tuples(st.floats(-0.7, 0.7), st.floats(-0.4, 0.4))


@given(places)
def test_a_ray_comes_back_through_the_lens(place):
    ray = np.array([place[0]]), np.array([place[1]])
    seen = distorted(*ray, IMAGER.distortion)
    np.testing.assert_allclose(undistorted(*seen, IMAGER.distortion), ray, atol=1e-9)


@given(places)
def test_a_point_is_seen_where_opencv_projects_it(place):
    point = np.array([[2.0 * place[0], 2.0 * place[1], 2.0]])
    expected, _ = cv2.projectPoints(point, np.zeros(3), np.zeros(3), IMAGER.K, np.array(IMAGER.distortion))
    np.testing.assert_allclose(project(IMAGER, point), expected.reshape(1, 2), atol=1e-6)


def test_every_pixel_has_the_ray_that_is_projected_to_it():
    lens = lens_of(IMAGER)
    points = np.stack([lens.x, lens.y, np.ones_like(lens.x)], axis=-1)[::40, ::40].astype(np.float64)
    columns, rows = np.meshgrid(np.arange(IMAGER.width)[::40], np.arange(IMAGER.height)[::40])
    np.testing.assert_allclose(project(IMAGER, points.reshape(-1, 3)), np.column_stack([columns.ravel(), rows.ravel()]), atol=1e-4)


def test_rows_know_how_high_and_low_they_look():
    lens = lens_of(IMAGER)
    assert np.all(lens.y.min(axis=1) >= lens.y_spans[:, 0])
    assert np.all(lens.y.max(axis=1) <= lens.y_spans[:, 1])
    assert np.all(np.diff(lens.y_spans, axis=0) >= 0.0)
