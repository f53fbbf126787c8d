from slam.navigation.blacklist import Blacklist


def test_an_entry_expires_and_comes_back_for_longer() -> None:
    blacklist = Blacklist(0.4, 30.0)
    blacklist.add((1.0, 1.0), 0.0)
    assert blacklist.holds((1.2, 1.2), 29.0)
    assert not blacklist.holds((1.2, 1.2), 31.0)
    blacklist.add((1.1, 1.0), 40.0)
    assert blacklist.times((1.0, 1.0)) == 2
    assert blacklist.holds((1.0, 1.0), 99.0)
    assert not blacklist.holds((1.0, 1.0), 101.0)


def test_places_farther_away_are_free() -> None:
    blacklist = Blacklist(0.4, 30.0)
    blacklist.add((1.0, 1.0), 0.0)
    assert not blacklist.holds((1.5, 1.0), 1.0)
    assert blacklist.times((1.5, 1.0)) == 0


def test_what_is_not_held_counts_and_may_be_tried_at_once() -> None:
    blacklist = Blacklist(0.4, 30.0)
    blacklist.add((1.0, 1.0), 5.0, held=False)
    assert blacklist.times((1.0, 1.0)) == 1
    assert not blacklist.holds((1.0, 1.0), 5.0)
