import math

import numpy as np
import pytest

from hardware.camera_spec import d435
from hardware.spec import RobotSpec
from sim.ground_truth import ground_truth
from sim.kinematic import Kinematic
from slam.errors import ParameterError
from slam.landmarks.hog_windows import levelling, overlap
from slam.landmarks.people import PeopleDetector
from slam.messages import Twist
from worlds.living import Person
from worlds.parts import Cylinder, Wall
from worlds.toml_file import dump_world
from worlds.world import World

ROBOT = RobotSpec(lidar=None, camera=d435((424, 240), (424, 240), rate=6))
WALLS = (
    Wall((-1.0, -4.0), (7.0, -4.0), 0.1, 2.6),
    Wall((7.0, -4.0), (7.0, 4.0), 0.1, 2.6),
    Wall((7.0, 4.0), (-1.0, 4.0), 0.1, 2.6),
    Wall((-1.0, 4.0), (-1.0, -4.0), 0.1, 2.6),
)
PEOPLE = ((4.0, 1.0), (4.5, -1.2))


@pytest.fixture(scope="module")
def picture(tmp_path_factory):
    """Two people who stand before the robot, a pillar between them."""
    people = tuple(Person((place,), seed=4 + i) for i, place in enumerate(PEOPLE))
    pillar = Cylinder((3.5, 0.0), 0.15, 1.75)
    world = World(name="two", walls=WALLS, start=(0.0, 0.0, 0.0), people=people, cylinders=(pillar,))
    path = tmp_path_factory.mktemp("world") / "two.toml"
    path.write_text(dump_world(world))
    with Kinematic(world=str(path), camera="raster", spec=ROBOT).build() as robot:
        robot.drive(Twist())
        robot.clock.sleep_until(0.4)
        image = robot.read().images[-1]
        return image, ground_truth(robot).people(image.stamp)


def test_people_are_found_and_the_pillar_is_not(picture):
    image, _ = picture
    assert len(PeopleDetector().detect(image)) == 2


def test_their_span_is_that_of_their_bodies(picture):
    image, people = picture
    sightings = sorted(PeopleDetector().detect(image), key=lambda sighting: -sighting.left[1])
    for sighting, person in zip(sightings, people, strict=True):
        left, right = (math.atan2(y, x) for x, y in (sighting.left, sighting.right))
        assert math.degrees(abs(0.5 * (left + right) - math.atan2(person.y, person.x))) < 1.5
        assert 0.2 < math.dist(sighting.left, sighting.right) < 0.7
        assert 0.5 < sighting.score < 1.0


def test_levelling_keeps_the_height_of_the_horizon(picture):
    info = picture[0].colour_info
    H = levelling(info)
    horizon = H @ np.array([info.K[0, 2], info.K[1, 2] + info.K[1, 1] * math.tan(math.radians(15.0)), 1.0])
    assert horizon[1] / horizon[2] == pytest.approx(info.K[1, 2] + info.K[1, 1] * math.tan(math.radians(15.0)), abs=1.0)


def test_overlap_of_boxes():
    assert overlap((0.0, 0.0, 2.0, 2.0), (1.0, 0.0, 2.0, 2.0)) == pytest.approx(1.0 / 3.0)
    assert overlap((0.0, 0.0, 1.0, 1.0), (5.0, 5.0, 1.0, 1.0)) == 0.0


@pytest.mark.parametrize("change", [{"widths": (0.5, 0.2)}, {"step": 0.0}, {"overlap": -1.0}])
def test_bad_parameters_are_refused(change):
    with pytest.raises(ParameterError):
        PeopleDetector(**change)
