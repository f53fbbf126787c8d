import pytest

from slam.errors import ParameterError
from slam.localization.health import HealthRules, HealthWatch


def after(shares, period=0.1, watch=None):
    watch = watch or HealthWatch(HealthRules())
    begin = 0.0 if watch.now != watch.now else watch.now + period
    for i, share in enumerate(shares):
        watch.add(begin + i * period, share)
    return watch


def test_a_pose_that_explains_the_scans_is_not_in_doubt():
    watch = after([0.95, 0.9, 0.97] * 20)
    assert not watch.doubtful
    assert not watch.lost


def test_a_kidnapped_robot_is_in_doubt_within_half_a_second_and_lost_within_three():
    watch = after([0.95] * 100)
    assert after([0.3] * 5, watch=watch).doubtful
    assert not watch.lost
    assert after([0.3] * 20, watch=watch).lost


def test_one_bad_scan_is_no_reason_to_give_up_the_pose():
    watch = after([0.95] * 100)
    assert not after([0.0] * 3, watch=watch).lost
    assert not after([0.95] * 12, watch=watch).doubtful


def test_a_room_that_has_changed_for_good_is_what_is_usual_there():
    assert not after([0.75] * 50).doubtful


def test_a_map_of_another_place_is_said_within_three_seconds():
    assert after([0.35] * 30).lost


def test_after_a_new_place_has_been_found_everything_begins_anew():
    watch = after([0.95] * 50 + [0.1] * 30)
    watch.forget()
    assert not after([0.7] * 3, watch=watch).doubtful
    assert not watch.lost


@pytest.mark.parametrize("wrong", [{"lost": 1.5}, {"quick": 0.0}])
def test_rules_that_mean_nothing_are_refused(wrong):
    with pytest.raises(ParameterError):
        HealthRules(**wrong)
