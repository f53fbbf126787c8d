import numpy as np

from slam.localization.global_search import Hypothesis
from slam.localization.rivals import Rivals
from slam.se2 import SE2

HERE = SE2(1.0, 1.0, 0.0)
FAR = SE2(5.0, 2.0, 1.0)
GAIN, EXPLAINED, ODDS = (0.35, 0.15), 0.6, 20.0


def hypothesis(pose, score, explained):
    return Hypothesis(pose, score, np.eye(3) * 1e-4, explained)


def weighed(there, here, views=2, place=FAR):
    """What is proven after so many scans on a way of 0.2 m each, that place and pose explain so."""
    rivals, odometry, proven = Rivals(), SE2(), []
    for k in range(views):
        pose = hypothesis(HERE @ odometry, *here)
        if rivals.due(0.3 * k, odometry):
            rivals.weigh([hypothesis(one, *there) for one in rivals.places(odometry)], pose, 0.3 * k, odometry)
        rivals.meet([hypothesis(place @ odometry, *there)], pose, 0.3 * k, odometry)
        proven = rivals.better(pose, GAIN, EXPLAINED, ODDS)
        odometry = odometry @ SE2(0.2)
    return proven


def test_a_place_that_explains_two_views_clearly_better_is_proven_where_odometry_leads():
    proven = weighed((-5.0, 0.9), (-60.0, 0.3))
    assert len(proven) == 1
    np.testing.assert_allclose(proven[0].T_map_base.as_array(), (FAR @ SE2(0.2)).as_array())


def test_one_view_proves_nothing():
    assert not weighed((-5.0, 0.9), (-60.0, 0.3), views=1)


def test_a_place_that_explains_little_more_is_not_believed_however_long():
    assert not weighed((-10.0, 0.62), (-25.0, 0.55), views=40)


def test_a_place_near_by_needs_less():
    assert weighed((-10.0, 0.8), (-25.0, 0.6), place=HERE @ SE2(0.4, 0.1, 0.1))
    assert not weighed((-10.0, 0.8), (-25.0, 0.6))


def test_a_place_that_proves_worse_is_dropped():
    rivals = Rivals()
    here = hypothesis(HERE, -20.0, 0.5)
    rivals.meet([hypothesis(FAR, -10.0, 0.7)], here, 0.0, SE2())
    rivals.weigh([hypothesis(FAR, -90.0, 0.2)], here, 0.5, SE2())
    assert len(rivals) == 0


def test_a_robot_that_stands_still_has_another_opinion_only_after_a_while():
    rivals = Rivals()
    rivals.meet([hypothesis(FAR, -10.0, 0.7)], hypothesis(HERE, -20.0, 0.5), 0.0, SE2())
    assert not rivals.due(0.2, SE2())
    assert rivals.due(0.6, SE2())
    assert rivals.due(0.2, SE2(0.1))


def test_a_better_place_takes_the_room_of_the_worst_of_many():
    rivals, here = Rivals(), hypothesis(HERE, -60.0, 0.3)
    crowd = [hypothesis(SE2(10.0 + 2.0 * k, 0.0), -50.0, 0.4) for k in range(12)]
    rivals.meet(crowd, here, 0.0, SE2())
    assert len(rivals) < len(crowd)
    rivals.meet([hypothesis(FAR, -5.0, 0.9)], here, 0.5, SE2())
    assert any(place == FAR for place in rivals.places(SE2()))


def test_places_met_at_a_scan_that_weighed_nobody_leave_the_others_where_odometry_leads():
    rivals, here = Rivals(), hypothesis(HERE, -60.0, 0.3)
    rivals.meet([hypothesis(FAR, -5.0, 0.9)], here, 0.0, SE2())
    rivals.meet([], here, 0.1, SE2(0.06))
    rivals.meet([], here, 0.2, SE2(0.12))
    np.testing.assert_allclose(rivals.places(SE2(0.12))[0].as_array(), (FAR @ SE2(0.12)).as_array(), atol=1e-12)
