import numpy as np
import pytest

from slam.errors import SlamError, UnknownNameError
from slam.grid import GridGeometry, OccupancyGrid
from slam.messages import Estimate, SensorFrame, Trajectory
from slam.navigation.policies import POLICIES, make_policy
from slam.se2 import SE2
from slam.snapshot import Snapshot

ROUTE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]])
SNAPSHOT = Snapshot(OccupancyGrid.empty(GridGeometry(0.05, 1, 1)), Trajectory(np.empty(0), np.empty(0)))


@pytest.mark.parametrize("name", sorted(POLICIES))
def test_every_policy_answers_an_estimate(name: str) -> None:
    twist = make_policy(name, ROUTE)(SensorFrame(0.0), Estimate(0.0, SE2(), SE2(), np.eye(3)), SNAPSHOT)
    assert twist is None or np.isfinite([twist.v, twist.omega]).all()


def test_the_policy_none_never_drives() -> None:
    assert make_policy("none", np.empty((0, 2)))(SensorFrame(0.0), Estimate(0.0, SE2(), SE2(), np.eye(3)), SNAPSHOT) is None


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(UnknownNameError, match="no policy 'tuor'; available: explore, goal, none, perimeter, spin, tour, wander"):
        make_policy("tuor", ROUTE)


def test_a_tour_without_a_route_says_what_to_do() -> None:
    with pytest.raises(SlamError, match="--policy none"):
        make_policy("tour", np.empty((0, 2)))
