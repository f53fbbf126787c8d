import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from worlds.errors import WorldFileError
from worlds.living import Door, Light, Person
from worlds.parts import Box, Cylinder, Marker, Poster, Wall
from worlds.toml_file import dump_world, parse_world, read_world
from worlds.world import World

ROOM = """\
name = "room"
start = [0, 0, 0.0]
tour = [
    [0, 0],  # [not, an item]
    [1, 0],
]

[[wall]]
from = [-2, 2]
to = [2, 2]

[[box]]
centre = [3, 0]
size = [1, 1, 1]

[[ box ]]
centre = [5, 0]
size = [1, 2, 0.5]
"""


def complaint(text):
    with pytest.raises(WorldFileError) as caught:
        parse_world(text, "room.toml")
    return str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[1, 2, 0.5]", "[1, -2, 0.5]", "room.toml line 18: box[1].size[1] = -2: must be a number > 0.0"),
        ("[1, 2, 0.5]", "[1, 2]", "room.toml line 18: box[1].size = [1, 2]: must be a list of length 3, got 2"),
        ("[1, 2, 0.5]", "[1, 'two', 3]", "room.toml line 18: box[1].size[1] = 'two': must be a number, got text"),
        ("[5, 0]", "[5, nan]", "room.toml line 17: box[1].centre[1] = nan: must be a finite number"),
        ("[5, 0]", "[-inf, 0]", "room.toml line 17: box[1].centre[0] = -inf: must be a finite number"),
        ("[5, 0]", "[1e6, 0]", "room.toml line 17: box[1].centre[0] = 1000000.0: must be a number <= 1000.0"),
        ("centre = [5, 0]\n", "", "room.toml line 16: box[1].centre is missing"),
        ("centre = [5", "middle = [5", "room.toml line 17: box[1].middle = [5, 0]: unknown key; allowed: centre, size, yaw, z, mass, name"),
        (
            "to = [2, 2]",
            "to = [2, 2]\n'end-x' = 1",
            "room.toml line 11: wall[0].end-x = 1: unknown key; allowed: from, to, thickness, height",
        ),
        ("[[wall]]", "[wall]", "room.toml line 8: wall = {'from': [-2, 2], 'to': [2, 2]}: must be a list, got a table"),
        ("[[wall]]", "[[walls]]", "room.toml line 8: walls = [{'from': [-2, 2], 'to': [2, 2]}]: unknown key; allowed: name, wall,"),
        ("to = [2, 2]", "to = [-2, 2]", "room.toml line 10: wall[0].to = [-2.0, 2.0]: must differ from `from`"),
        ('"room"', "7", "room.toml line 1: name = 7: must be text, got an integer"),
        ('name = "room"\n', "", "room.toml: name is missing"),
        ('name = "room"', 'name = "room', "room.toml line 1: not TOML: Illegal character"),
        ('name = "room"', "name =", "room.toml line 1: not TOML: Invalid value"),
        ("size = [1, 1, 1]", "size = [1, 1, 1]\nsize = [1, 1, 1]", "room.toml line 15: not TOML: Cannot overwrite a value"),
        ("size = [1, 2, 0.5]\n", "size = [1, 2", "room.toml line 18: not TOML: Unclosed array"),
        ('name = "room"', "name = " + 9999 * "[", "room.toml: not TOML: maximum recursion depth"),
        ('name = "room"', "name = " + 9999 * "9", "room.toml: not TOML: Exceeds the limit (4300 digits)"),
        ("    [1, 0],", "    [1, nan],", "room.toml line 5: tour[1][1] = nan: must be a finite number"),
        (
            "    [1, 0],",
            "    [1, 0],\n    [1, 3],",
            "room.toml line 6: tour[2] = [1.0, 3.0]: needs 0.13 m of free space on the way from [1.0, 0.0]",
        ),
        ("[5, 0]", "[5, 0]\nmaterial = 'wood'", "room.toml line 18: box[1].material = 'wood': must be one of matte, dark, glossy, glass"),
        (
            "[[wall]]",
            "[light]\nlevels = [[0, 1], [5, -1]]\n\n[[wall]]",
            "room.toml line 9: light.levels[1][1] = -1: must be a number >= 0.0",
        ),
        ("[[wall]]", "[light]\nlevels = [[5, 1], [5, 2]]\n\n[[wall]]", "room.toml line 9: light.levels = [(5.0, 1.0), (5.0, 2.0)]: times"),
        ("[[wall]]", "[[person]]\npath = []\n\n[[wall]]", "room.toml line 9: person[0].path = []: must be a list of length >= 1"),
        (
            "[[wall]]",
            "[[person]]\npath = [[0, 0], [0, 1.9]]\n\n[[wall]]",
            "room.toml line 9: person[0].path[1] = [0.0, 1.9]: needs 0.2 m of free space on the way from [0.0, 0.0], has 0.050 m",
        ),
        ("start = [0, 0, 0.0]", "start = [0, 2, 0.0]", "room.toml line 2: start = [0.0, 2.0]: needs 0.13 m of free space, has 0.000 m"),
    ],
)
def test_a_wrong_file_names_the_line_the_value_and_what_is_allowed(old, new, message):
    assert old in ROOM
    assert complaint(ROOM.replace(old, new)).startswith(message)


def test_complaints_are_one_line():
    assert "\n" not in complaint(ROOM.replace('"room"', '"""a\nb"""').replace("[5, 0]", "0"))


def test_an_inline_table_over_several_lines_is_found_too():
    text = 'name = "room"\nstart = [0, 0, 0]\nwall = [\n  {from = [0, 1], to = [1, 1]},\n  {from = [0, 2], to = [0, 2]},\n]\n'
    assert complaint(text).startswith("room.toml line 5: wall[1].to = [0.0, 2.0]: must differ")


def test_an_empty_file_lacks_a_name():
    assert complaint("") == "room.toml: name is missing"


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(WorldFileError, match=r"gone\.toml: cannot be read: No such file"):
        read_world(tmp_path / "gone.toml")


def test_a_binary_file_is_named(tmp_path):
    path = tmp_path / "photo.toml"
    path.write_bytes(b"\x89PNG\xff")
    with pytest.raises(WorldFileError, match=r"photo\.toml: is not a text file in UTF-8"):
        read_world(path)


coordinates = st.floats(10.0, 900.0)
lengths = st.floats(1e-3, 100.0)
angles = st.floats(-6.28, 6.28)
points = st.tuples(coordinates, coordinates)
texts = st.text(st.characters(exclude_categories=["Cs"]))


@st.composite
def worlds(draw):
    # Everything solid stands in the quadrant x, y >= 10; the robot keeps to the other.
    walls = st.builds(Wall, points, st.tuples(st.floats(-900.0, -10.0), coordinates), lengths, lengths)
    boxes = st.builds(Box, points, st.tuples(lengths, lengths, lengths), angles, lengths, lengths, texts)
    cylinders = st.builds(Cylinder, points, st.floats(1e-3, 5.0), lengths, lengths, lengths, texts)
    ids = draw(st.lists(st.integers(0, 249), unique=True, max_size=4))
    markers = [draw(st.builds(Marker, st.just(i), st.tuples(coordinates, coordinates, lengths), angles, lengths)) for i in ids]
    posters = st.builds(Poster, st.tuples(coordinates, coordinates, lengths), angles, st.tuples(lengths, lengths), st.integers(0, 99))
    states = st.sampled_from(["closed", "open", "ajar", "swinging"])
    doors = st.builds(Door, points, angles, st.floats(0.5, 2.0), state=states, delay=st.floats(0.0, 99.0), period=st.floats(6.0, 99.0))
    free = st.tuples(st.floats(-900.0, -300.0), st.floats(-900.0, -300.0))
    paths = st.lists(free, min_size=1, max_size=3).map(tuple)
    people = st.builds(Person, paths, st.floats(0.1, 3.0), st.lists(st.floats(0.0, 9.0), max_size=3).map(tuple), seed=st.integers(0, 99))
    times = draw(st.lists(st.floats(0.0, 600.0), unique=True, max_size=3).map(sorted))
    return World(
        name=draw(texts),
        walls=tuple(draw(st.lists(walls, min_size=1, max_size=3))),
        start=(*draw(free), draw(angles)),
        description=draw(texts),
        tour=tuple(draw(st.lists(free, max_size=3))),
        boxes=tuple(draw(st.lists(boxes, max_size=3))),
        cylinders=tuple(draw(st.lists(cylinders, max_size=3))),
        markers=tuple(markers),
        posters=tuple(draw(st.lists(posters, max_size=2))),
        doors=tuple(draw(st.lists(doors, max_size=2))),
        people=tuple(draw(st.lists(people, max_size=2))),
        light=Light(draw(st.floats(0.0, 4.0)), levels=tuple((time, draw(st.floats(0.0, 4.0))) for time in times)),
        floor=draw(st.sampled_from(["plain", "tiles"])),
    )


@settings(deadline=None)
@given(worlds())
def test_a_world_written_reads_back_equal(world):
    assert parse_world(dump_world(world), "written.toml") == world


@settings(deadline=None)
@given(worlds(), st.data())
def test_the_line_of_a_wrong_value_is_found_in_any_written_world(world, data):
    lines = dump_world(world).split("\n")
    number = data.draw(st.sampled_from([i for i, line in enumerate(lines) if line.startswith(("size = ", "height = ", "yaw = "))]))
    lines[number] = lines[number].split(" = ")[0] + " = false"
    assert complaint("\n".join(lines)).startswith(f"room.toml line {number + 1}: ")
