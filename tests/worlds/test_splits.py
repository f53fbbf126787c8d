import numpy as np
import pytest
from scipy import ndimage

from worlds import splits
from worlds.loader import load_world
from worlds.splits import FAMILIES, MapName, SplitError, map_names, measured, pinned

NAMES = [name for split in ("train", "validation", "test") for name in map_names(split)]
SAMPLE = [NAMES[i] for i in np.random.default_rng(0).choice(len(NAMES), 24, replace=False)]


def test_the_splits_have_their_sizes():
    assert [len(map_names(split)) for split in ("train", "validation", "test")] == [5000, 200, 300]
    assert all(len(map_names("test", level)) == 100 for level in ("easy", "medium", "complex"))


def test_no_map_is_in_two_splits():
    assert len({name.text for name in NAMES}) == len(NAMES)


def test_every_split_has_all_families_and_difficulties():
    for split in ("train", "validation", "test"):
        assert len({(name.family, name.difficulty) for name in map_names(split)}) == 3 * len(FAMILIES)


@pytest.mark.parametrize("name", SAMPLE, ids=lambda name: name.text)
def test_a_frozen_map_comes_out_as_it_was(name):
    assert measured(name) == pinned()[name]


@pytest.mark.parametrize("text", [MapName("test", "medium", i).text for i in range(len(FAMILIES))])
def test_a_robot_with_room_to_spare_gets_nearly_everywhere(text, cells):
    world = load_world(text)
    solid, places = cells(world, 0.35)
    air, _ = ndimage.label(~solid)
    start = places(world.start[:2])
    wide = ndimage.distance_transform_edt(~solid) * 0.02 >= 0.2
    reached, _ = ndimage.label(wide & (air == air[start]))
    assert (reached == reached[start]).sum() > 0.98 * (wide & (air == air[start])).sum()


def test_a_changed_map_has_another_digest():
    world = load_world(MapName("train", "easy", 3).text)
    assert splits.digest(world) != splits.digest(load_world(MapName("train", "easy", 3).text.replace(",seed=", ",seed=1")))


@pytest.mark.parametrize(
    ("wrong", "message"), [(("exam",), "no split"), (("test", "hard"), "no difficulty"), (("test", "", "lake"), "no family")]
)
def test_an_unknown_name_is_named_with_those_there_are(wrong, message):
    with pytest.raises(SplitError, match=f"{message} '{wrong[-1]}'; available: "):
        map_names(*wrong)


def test_an_index_beyond_the_split_is_refused():
    with pytest.raises(SplitError, match="no map 100 in 'test'; it has 0 to 99"):
        MapName("test", "easy", 100)
