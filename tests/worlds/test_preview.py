import pytest

from scripts.preview import draw_world
from scripts.runs.files import OutputError
from scripts.worlds import main
from worlds.errors import UnknownWorldError, WorldFileError
from worlds.loader import load_world, world_names


@pytest.mark.parametrize("name", world_names())
def test_a_preview_shows_every_solid_and_every_marker(name):
    world = load_world(name)
    axes = draw_world(world).axes[0]
    assert len(axes.patches) == len(world.solids) + len(world.doors) + 1  # the robot
    assert {text.get_text() for text in axes.texts if text.get_text()} == {str(marker.id) for marker in world.markers}


def test_preview_writes_a_picture(tmp_path):
    assert main(["preview", "corridor", "--out", str(tmp_path / "x.png")]) == 0
    assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")


def test_export_writes_a_file_that_loads_equal(tmp_path):
    path = tmp_path / "x.toml"
    assert main(["export", "aruco_room:spacing=0.3", "--out", str(path)]) == 0
    assert load_world(str(path)) == load_world("aruco_room:spacing=0.3")


def test_list_is_the_default_and_names_all_worlds(capsys):
    assert main([]) == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in world_names())


def test_an_unwritable_folder_is_one_clear_error(tmp_path):
    with pytest.raises(OutputError, match=r"cannot write .*gone/x\.toml: No such file or directory"):
        main(["export", "corridor", "--out", str(tmp_path / "gone" / "x.toml")])


def test_an_unknown_picture_format_lists_the_known():
    with pytest.raises(WorldFileError, match=r"must end in \.png, \.svg, \.pdf"):
        main(["preview", "corridor", "--out", "x.bmp"])


def test_nothing_is_written_for_an_unknown_world(tmp_path):
    with pytest.raises(UnknownWorldError):
        main(["export", "hallway", "--out", str(tmp_path / "x.toml")])
    assert list(tmp_path.iterdir()) == []
