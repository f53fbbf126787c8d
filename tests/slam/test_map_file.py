import math

import numpy as np
import pytest
import yaml
from PIL import Image

from slam.errors import MapFileError
from slam.grid import FREE, OCCUPIED, UNKNOWN, GridGeometry, OccupancyGrid
from slam.hits_file import write_hits
from slam.map_file import read_map, write_map
from slam.se2 import SE2

PUBLIC = ["turtlebot3_map", "nav2_depot", "f1tenth_stata_basement", "f1tenth_levine"]
GOOD = {"image": "m.png", "resolution": 0.05, "origin": [0.0, 0.0, 0.0], "negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196}


def saved(folder, pixels, **changes):
    """A map on disk with the given picture, the top row first; a change to None leaves the key out."""
    Image.fromarray(np.array(pixels, np.uint8)).save(folder / "m.png")
    fields = {key: value for key, value in (GOOD | changes).items() if value is not None}
    (folder / "m.yaml").write_text(yaml.safe_dump(fields))
    return folder / "m.yaml"


def top_row(folder, pixels, **changes):
    return read_map(saved(folder, [pixels], **changes)).states()[-1].tolist()


@pytest.mark.parametrize("name", PUBLIC)
def test_public_maps_keep_their_classes_and_their_place(shared_data, tmp_path, name):
    original = read_map(shared_data / "maps" / f"{name}.yaml")
    write_map(original, tmp_path / "copy")
    copy = read_map(tmp_path / "copy.yaml")
    assert copy.geometry == original.geometry
    assert np.array_equal(copy.states(), original.states())


@pytest.mark.parametrize("name", PUBLIC[:2])
def test_maps_of_three_greys_keep_their_pixels(shared_data, tmp_path, name):
    write_map(read_map(shared_data / "maps" / f"{name}.yaml"), tmp_path / "copy")
    with Image.open(tmp_path / "copy.pgm") as copy, Image.open(shared_data / "maps" / f"{name}.pgm") as original:
        assert np.array_equal(np.asarray(copy), np.asarray(original))


def test_origin_may_be_shifted_and_turned(tmp_path):
    geometry = GridGeometry(0.025, 3, 2, SE2(-1.25, 7.5, 0.3))
    grid = OccupancyGrid.from_states(geometry, np.array([[OCCUPIED, FREE, UNKNOWN], [FREE, FREE, FREE]], np.int8))
    write_map(grid, tmp_path / "room.v2")
    read = read_map(tmp_path / "room.v2.yaml")
    assert read.geometry == geometry
    assert np.array_equal(read.states(), grid.states())
    assert np.allclose(read.wall_points(), grid.wall_points())


def test_the_top_row_of_the_picture_has_the_highest_y(tmp_path):
    grid = read_map(saved(tmp_path, [[0], [254], [254]]))
    assert grid.wall_points().tolist() == [pytest.approx([0.025, 0.125])]


def test_greys_become_classes_at_the_thresholds(tmp_path):
    assert top_row(tmp_path, [0, 89, 90, 204, 205, 206, 255]) == [100, 100, -1, -1, -1, 0, 0]


def test_205_stays_unknown_at_the_thresholds_of_nav2(tmp_path):
    assert top_row(tmp_path, [205, 200], free_thresh=0.25) == [-1, 0]


def test_negate_makes_white_occupied(tmp_path):
    assert top_row(tmp_path, [0, 255], negate=1) == [0, 100]


def test_scale_gives_probabilities_between_the_thresholds(tmp_path):
    grid = read_map(saved(tmp_path, [[255, 128, 99, 0]], mode="scale", free_thresh=0.1, occupied_thresh=0.9))
    probability = 1.0 / (1.0 + np.exp(-grid.log_odds[0]))
    assert probability == pytest.approx([0.0067, 0.5, 0.64, 0.9933], abs=1e-4)


def test_raw_pixels_are_percentages_and_the_rest_unknown(tmp_path):
    assert top_row(tmp_path, [0, 10, 50, 100, 101, 255], mode="raw") == [0, 0, -1, 100, -1, -1]


def test_205_is_no_special_grey_in_scale_mode(tmp_path):
    assert top_row(tmp_path, [205], mode="scale", free_thresh=0.25) == [0]


def test_transparency_is_a_channel_in_trinary_and_unknown_in_scale(tmp_path):
    clear_black, solid_black = (0, 0, 0, 0), (0, 0, 0, 255)
    assert top_row(tmp_path, [clear_black, solid_black]) == [100, 100]
    assert top_row(tmp_path, [(250, 250, 250, 0)]) == [-1]
    assert top_row(tmp_path, [clear_black, solid_black], mode="scale") == [-1, 100]


def test_colours_are_averaged(tmp_path):
    assert top_row(tmp_path, [(255, 0, 0), (255, 255, 250)]) == [100, 0]


def test_sixteen_bits_are_brought_to_eight(tmp_path):
    path = saved(tmp_path, [[0]], image="m.pgm")
    (tmp_path / "m.pgm").write_bytes(b"P5\n2 1\n65535\n\xff\xff\x00\x00")
    assert read_map(path).states().tolist() == [[0, 100]]


def test_a_number_in_exponent_notation_is_a_number(tmp_path):
    path = saved(tmp_path, [[0]])
    path.write_text(path.read_text().replace("0.05", "5e-2"))
    assert read_map(path).geometry.resolution == 0.05


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"image": "gone.png"}, "gone.png does not exist"),
        ({"image": None}, "key 'image' is missing"),
        ({"origin": None}, "key 'origin' is missing"),
        ({"resolution": 0.0}, "resolution 0.0 must be positive"),
        ({"resolution": -0.05}, "resolution -0.05 must be positive"),
        ({"resolution": "fine"}, "resolution 'fine' must be a finite number"),
        ({"origin": [0.0, math.nan, 0.0]}, "origin 'nan' must be a finite number"),
        ({"origin": [0.0, 0.0]}, r"must be \[x, y, yaw\]"),
        ({"mode": "ternary"}, "mode 'ternary' must be one of trinary, scale, raw"),
        ({"free_thresh": 0.7}, "must be ordered within 0..1"),
    ],
)
def test_a_wrong_description_is_refused_in_one_line(tmp_path, changes, message):
    with pytest.raises(MapFileError, match=message) as caught:
        read_map(saved(tmp_path, [[0]], **changes))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"), [("image: [", "is not YAML"), ("just words", "must be a YAML mapping"), ("", "must be a YAML mapping")]
)
def test_what_is_not_a_description_is_refused_in_one_line(tmp_path, text, message):
    (tmp_path / "m.yaml").write_text(text)
    with pytest.raises(MapFileError, match=message) as caught:
        read_map(tmp_path / "m.yaml")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"P5\n4 4\n255\n\x00\x00", b"not a picture", b"\x89PNG\r\n\x1a\n\x00\x00"])
def test_an_image_that_cannot_be_decoded_is_refused(tmp_path, content):
    path = saved(tmp_path, [[0]])
    (tmp_path / "m.png").write_bytes(content)
    with pytest.raises(MapFileError, match="cannot be decoded"):
        read_map(path)


def test_a_missing_description_is_refused(tmp_path):
    with pytest.raises(MapFileError, match="cannot be read"):
        read_map(tmp_path / "m.yaml")


def test_a_folder_that_is_not_there_is_refused_and_nothing_is_left(tmp_path):
    grid = OccupancyGrid.empty(GridGeometry(0.05, 2, 2))
    with pytest.raises(MapFileError, match="cannot be written"):
        write_map(grid, tmp_path / "gone" / "m")
    assert list(tmp_path.iterdir()) == []


def hit_grid(shift):
    grid = OccupancyGrid.empty(GridGeometry(0.05, 6, 4, SE2(1.0, 2.0)))
    grid.log_odds[:] = -5.0
    grid.log_odds[2, 1:5] = 5.0
    grid.hit_count[2, 1:5] = [3.0, 1.0, 4.0, 2.0]
    grid.hit_offset[2, 1:5] = shift
    return grid


def test_a_map_keeps_its_hits_beside_it(tmp_path):
    grid = hit_grid((0.01, -0.02))
    write_map(grid, tmp_path / "map")
    write_hits(grid, tmp_path / "map.hits.npz")
    read = read_map(tmp_path / "map.yaml")
    np.testing.assert_allclose(read.wall_points(), grid.wall_points(), atol=1e-6)
    np.testing.assert_array_equal(read.hit_count, grid.hit_count)


def test_hits_of_cells_that_were_painted_free_are_left_aside(tmp_path):
    grid = hit_grid((0.01, -0.02))
    write_hits(grid, tmp_path / "map.hits.npz")
    grid.log_odds[2, 1] = -5.0
    write_map(grid, tmp_path / "map")
    read = read_map(tmp_path / "map.yaml")
    assert len(read.wall_points()) == 3
    assert read.hit_count[2, 1] == 0.0


def spoilt(path):
    path.write_bytes(b"PK\x03\x04 nothing")


def of_another_map(path):
    write_hits(hit_grid((0.0, 0.0)), path)


@pytest.mark.parametrize("write", [spoilt, of_another_map])
def test_hits_that_do_not_fit_the_map_are_named_and_left_aside(tmp_path, caplog, write):
    grid = OccupancyGrid.from_states(GridGeometry(0.05, 3, 3), np.full((3, 3), 100, np.int8))
    write_map(grid, tmp_path / "map")
    write(tmp_path / "map.hits.npz")
    read = read_map(tmp_path / "map.yaml")
    np.testing.assert_allclose(read.wall_points(), grid.wall_points())
    assert "map.hits.npz is left aside" in caplog.text
