"""The fixed-lag smoother on straight lines."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from slam.fusion.smoother import FusionLibraryError, Smoother, library
from slam.se2 import SE2

STEP, SURE, ROUGH = SE2(0.1, 0.0, 0.05), np.eye(3) * 1e-6, np.eye(3) * 1e-4


def driven(start: SE2, steps: int, lag: float = 2.0) -> tuple[Smoother, SE2]:
    smoother, true = Smoother(lag, 3.0, start, 0.0), start
    for k in range(1, steps + 1):
        true = true @ STEP
        smoother.step(0.1 * k, STEP, SURE)
        smoother.solve()
    return smoother, true


def test_without_places_the_steps_add_up() -> None:
    smoother, true = driven(SE2(1.0, -2.0, 2.5), 30)
    np.testing.assert_allclose((true.inverse() @ smoother.pose(smoother.newest)).as_array(), 0.0, atol=1e-6)
    assert min(smoother.stamps.values()) >= 0.9


def test_a_covariance_is_of_the_map_axes() -> None:
    """Well known along, badly across: seen from a robot that looks along y."""
    smoother = Smoother(2.0, 3.0, SE2(0.0, 0.0, np.pi / 2), 0.0)
    smoother.step(0.1, SE2(0.1), np.diag([1e-2, 1e-6, 1e-6]))
    smoother.solve()
    covariance = smoother.covariance()
    assert covariance[1, 1] == pytest.approx(1e-2, rel=0.01)
    assert covariance[0, 0] < 1e-5


def test_a_place_of_the_map_axes_pulls_along_them() -> None:
    smoother = Smoother(2.0, 100.0, SE2(0.0, 0.0, np.pi / 2), 0.0)
    smoother.step(0.1, SE2(), np.diag([1e-2, 1e-2, 1e-6]))
    smoother.place(smoother.newest, SE2(0.1, 0.1, np.pi / 2), np.diag([1e-6, 1e2, 1e-2]))
    smoother.solve()
    pose = smoother.pose(smoother.newest)
    assert pose.x == pytest.approx(0.1, abs=1e-3)
    assert pose.y == pytest.approx(0.0, abs=1e-3)


def test_one_place_far_off_is_not_believed() -> None:
    smoother, true = driven(SE2(), 10)
    for node in range(3, 11):
        smoother.place(node, smoother.pose(node), ROUGH)
    smoother.place(10, SE2(5.0, 5.0, 1.0), ROUGH)
    smoother.solve()
    off = true.inverse() @ smoother.pose(10)
    assert np.hypot(off.x, off.y) < 0.02


def test_where_the_other_map_lies_is_found() -> None:
    smoother, T_map_other = driven(SE2(), 1)[0], SE2(0.05, -0.03, 0.02)
    smoother.drift(1.0, 0.0)
    for k in range(2, 40):
        smoother.step(0.1 * k, STEP, ROUGH)
        pose = SE2()
        for _ in range(k):
            pose = pose @ STEP
        smoother.place(smoother.newest, pose, SURE)
        smoother.place_in_other(smoother.newest, T_map_other.inverse() @ pose, SURE)
        smoother.solve()
    np.testing.assert_allclose((T_map_other.inverse() @ smoother.T_map_other).as_array(), 0.0, atol=1e-3)


def test_without_gtsam_the_way_to_it_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gtsam", None)
    with pytest.raises(FusionLibraryError, match="pip install"):
        library()
