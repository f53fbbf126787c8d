from pathlib import Path

import cv2
import numpy as np
import pytest

from slam.landmarks.camera_info_file import CameraInfoFileError, read_camera_info, write_camera_info
from slam.landmarks.markers import MarkerImageError, Markers
from slam.messages import CameraInfo

CAMERA = CameraInfo(
    640, 480, np.array([[500.0, 0.0, 315.0], [0.0, 502.0, 245.0], [0.0, 0.0, 1.0]]), np.array([-0.1, 0.05, 0.001, -0.002, 0.3])
)


def test_a_camera_is_read_as_it_was_written(tmp_path: Path) -> None:
    write_camera_info(tmp_path / "a.yaml", CAMERA, "front", "two\nlines")
    read = read_camera_info(tmp_path / "a.yaml")
    assert (read.width, read.height) == (640, 480)
    np.testing.assert_array_equal(read.K, CAMERA.K)
    np.testing.assert_array_equal(read.D, CAMERA.D)
    assert (tmp_path / "a.yaml").read_text().startswith("# two\n# lines\nimage_width: 640\n")
    assert [path.name for path in tmp_path.iterdir()] == ["a.yaml"]


def test_fewer_coefficients_are_filled_with_zeros(tmp_path: Path) -> None:
    write_camera_info(tmp_path / "a.yaml", CAMERA)
    text = (tmp_path / "a.yaml").read_text().replace("-0.002, 0.3]", "-0.002]")
    (tmp_path / "a.yaml").write_text(text)
    np.testing.assert_array_equal(read_camera_info(tmp_path / "a.yaml").D, [-0.1, 0.05, 0.001, -0.002, 0.0])


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("plumb_bob", "equidistant", "distortion_model equidistant; plumb_bob is right"),
        ("image_width: 640", "image_width: wide", "image_width and image_height must be whole numbers"),
        ("camera_matrix", "matrix", "camera_matrix needs `data`"),
        ("[500.0, 0.0,", "[0.0, 0.0,", "focal lengths above 0"),
        ("[500.0, 0.0,", "[.nan, 0.0,", "camera_matrix must be finite"),
        ("0.3]", "0.3, 0.1, 0.1, 0.1]", "8 distortion coefficients; at most 5"),
        ("image_width: 640", "image_width: [", "not YAML"),
    ],
)
def test_a_file_that_cannot_be_used_says_why(tmp_path: Path, old: str, new: str, problem: str) -> None:
    write_camera_info(tmp_path / "a.yaml", CAMERA)
    (tmp_path / "a.yaml").write_text((tmp_path / "a.yaml").read_text().replace(old, new, 1))
    with pytest.raises(CameraInfoFileError, match=problem):
        read_camera_info(tmp_path / "a.yaml")


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(CameraInfoFileError, match=r"camera file .*nothing\.yaml: No such file"):
        read_camera_info(tmp_path / "nothing.yaml")


def test_markers_are_measured_with_the_file_s_camera(tmp_path: Path) -> None:
    write_camera_info(tmp_path / "a.yaml", CAMERA)
    image = np.full((480, 640), 255, np.uint8)
    image[100:300, 200:400] = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_ARUCO_MIP_36h12), 5, 200)
    other = CameraInfo(640, 480, 2.0 * CAMERA.K, np.zeros(5))
    expected = Markers().build().detect(image, CAMERA).sightings[0]
    found = Markers(camera_info=str(tmp_path / "a.yaml")).build().detect(image, other).sightings[0]
    np.testing.assert_array_equal(found.rays, expected.rays)
    with pytest.raises(MarkerImageError, match="the image is 320 x 240, its K is for 640 x 480"):
        Markers(camera_info=str(tmp_path / "a.yaml")).build().detect(image[::2, ::2], other)
