import numpy as np
import pytest
from msgspec import structs
from PIL import Image

from scripts.camera_view import SMALL, best_view, camera_view, whole_people
from scripts.worlds import main
from sim.living import Living
from sim.raster.painter import RasterPainter
from sim.scenery import Scenery
from worlds.errors import WorldFileError
from worlds.living import Person
from worlds.loader import load_world


def test_the_preview_shows_what_the_camera_sees(tmp_path):
    out = tmp_path / "view.png"
    assert main(["preview", "aruco_room", "--camera", "--view", "0", "0", "20", "--out", str(out)]) == 0
    picture = np.asarray(Image.open(out))
    assert picture.shape == (480, 848, 3)
    assert np.std(picture) > 20.0


def test_a_picture_of_the_camera_is_no_drawing(tmp_path):
    with pytest.raises(WorldFileError, match=r"must end in \.png, \.jpg"):
        main(["preview", "aruco_room", "--camera", "--out", str(tmp_path / "view.svg")])


def test_time_moves_the_people():
    world = structs.replace(load_world("aruco_room:furniture=false"), people=(Person(((1.5, -1.0), (1.5, 1.0))),))
    before, after = (camera_view(world, (-1.5, 0.0, 0.0), t) for t in (0.0, 2.0))
    assert np.mean(before != after) > 0.01


def test_the_office_shows_people_from_head_to_foot():
    world = load_world("office")
    scenery = Scenery(world, Living(world, 4.0))
    painter = RasterPainter(scenery.faces, scenery.light)
    assert whole_people(scenery.people_of(painter.see(SMALL, best_view(world, scenery, painter)))) >= 1
