import numpy as np

from slam.messages import Estimate, SensorFrame, Status, Twist
from slam.navigation.astray import Astray
from slam.se2 import SE2


def ask(searcher, stamp, status, yaw=0.0):
    pose = SE2(0.0, 0.0, yaw)
    return searcher(SensorFrame(stamp), Estimate(stamp, pose, SE2(), np.eye(3), status, reason="no match"))


def test_who_knows_the_place_is_left_alone() -> None:
    assert ask(Astray().build(), 0.0, Status.TRACKING) is None
    assert ask(Astray().build(), 0.0, Status.DEGRADED) is None


def test_who_is_lost_stops_then_looks_around_then_drives_on(caplog) -> None:
    searcher = Astray().build()
    assert ask(searcher, 0.0, Status.LOST) == Twist()
    assert ask(searcher, 0.6, Status.LOST) == Twist(0.0, 0.5)
    for step in range(90):
        twist = ask(searcher, 0.7 + 0.1 * step, Status.LOST, 0.1 * step)
    assert twist == Twist()  # the safe course stands still without a scan
    assert ask(searcher, 20.0, Status.TRACKING) is None
    assert caplog.text.count("does not know where it is (no match)") == 1
    assert "after 20.0 s" in caplog.text
