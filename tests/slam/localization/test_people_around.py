import math

import numpy as np

from slam.landmarks.people import PersonSighting
from slam.localization.people_around import Carrying, PeopleAround
from slam.se2 import SE2

AHEAD = PersonSighting(10.0, (3.0, 0.2), (3.0, -0.2), 0.9, (0.0, 0.0, 1.0, 1.0))

HERE = SE2()


def beams(*bearings):
    angles = np.array(bearings)
    return np.zeros((len(angles), 2)), np.column_stack([np.cos(angles), np.sin(angles)])


def seen(sighting, bearings, T_odom_base=HERE, now=10.0):
    people = PeopleAround(Carrying())
    people.see((sighting,), SE2())
    return people.probabilities(*beams(*bearings), T_odom_base, now)


def test_the_middle_of_a_person_has_its_score_and_beams_beside_it_nothing():
    q = seen(AHEAD, [0.0, 0.05, 0.5])
    assert q[0] == 0.9
    assert 0.0 < q[1] < q[0]
    assert q[2] == 0.0


def test_a_turned_robot_sees_the_person_elsewhere():
    assert seen(AHEAD, [-math.pi / 2], SE2(0.0, 0.0, math.pi / 2))[0] > 0.89


def test_two_sightings_are_mixed_by_noisy_or():
    people = PeopleAround(Carrying())
    people.see((AHEAD, AHEAD), SE2())
    assert abs(people.probabilities(*beams(0.0), SE2(), 10.0)[0] - 0.99) < 1e-9


def test_a_sighting_widens_and_is_forgotten():
    assert seen(AHEAD, [0.25], now=10.0)[0] == 0.0
    assert seen(AHEAD, [0.25], now=10.5)[0] > 0.1
    assert seen(AHEAD, [0.0], now=11.0)[0] == 0.0
