"""The pictures of a run's marker map."""

import numpy as np
from PIL import Image

from scripts.bench.marker_scenes import MOUNT, MarkerScene
from scripts.runs.marker_pictures import SIZE, Outlook, write_marker_pictures
from scripts.runs.marker_views import WIDTH, MarkerView
from slam.messages import Trajectory
from slam.se2 import SE2
from slam.se3 import SE3


def test_the_pictures_show_the_camera_beside_the_map_that_grows(tmp_path) -> None:
    scene = MarkerScene()
    path, ids = scene.path(12, 0.2), list(scene.truth().markers)
    picture = np.full((240, WIDTH, 3), 90, np.uint8)
    views = [MarkerView(float(k), picture, SE3.from_se2(pose) @ MOUNT, tuple(ids[: 3 * k])) for k, pose in enumerate(path)]
    way = Trajectory(np.arange(12.0), np.array([pose.as_array() for pose in path]))
    write_marker_pictures(tmp_path, "a run", (scene.truth(), way), views)
    with Image.open(tmp_path / "markers.png") as whole, Image.open(tmp_path / "markers.gif") as film:
        assert whole.size == film.size == (WIDTH + SIZE[0], whole.height)
        assert film.n_frames == len(views)
        film.seek(1)
        early = np.asarray(film.convert("L"))[:, WIDTH:]
        film.seek(len(views) - 1)
        late = np.asarray(film.convert("L"))[:, WIDTH:]
    assert (late < 80).sum() > 2 * (early < 80).sum()


def test_all_points_lie_in_the_picture_from_every_side() -> None:
    points = np.random.default_rng(0).uniform(-3.0, 3.0, (50, 3))
    for azimuth in np.linspace(-3.0, 3.0, 7):
        pixels = np.array(Outlook.over(points, float(azimuth)).pixels(points))
        assert pixels.min() >= 0.0
        assert (pixels <= 2 * np.array(SIZE)).all()


def test_a_run_with_no_marker_has_an_outlook_too() -> None:
    assert np.isfinite(Outlook.over(np.zeros((1, 3)), 0.0).pixels(np.array([[SE2().x, 0.0, 0.0]]))).all()
