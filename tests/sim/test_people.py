import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.figure import FOOT, SHANK, TRUNK, Cone, figure, round_cone
from sim.people import TICK, Walker
from worlds.living import Person

PATH = ((0.0, 0.0), (4.0, 0.0), (6.0, 1.0), (2.0, 4.0))


def frames_of(walker: Walker, times):
    return walker.frames(np.column_stack([times, np.ones_like(times)]))


def heights(walker: Walker, frames):
    """z of every corner of every part (K, corners) [m]."""
    parts = zip(walker.parts, frames, strict=True)
    return np.hstack([frame[:, 6:9] @ part.triangles.reshape(-1, 3).T + frame[:, 11:] for part, frame in parts])


@pytest.mark.parametrize("radii", [(0.1, 0.1), (0.12, 0.05)])
def test_a_round_cone_is_closed_and_faces_outwards(radii):
    triangles = round_cone(Cone((0.0, 0.0, 0.0), (0.1, 0.2, 0.5), *radii, (0, 0, 0)))
    volume = np.einsum("ij,ij->i", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])).sum() / 6.0
    length, (a, b) = math.sqrt(0.3), radii
    assert volume == pytest.approx(math.pi * length * (a * a + a * b + b * b) / 3 + 2 / 3 * math.pi * (a**3 + b**3), rel=0.12)
    assert np.abs(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]).sum(axis=0)).max() < 1e-12


@settings(max_examples=10, deadline=None)
@given(height=st.floats(1.6, 1.9), seed=st.integers(0, 1000))
def test_who_stands_is_as_tall_as_they_should_be_with_both_feet_on_the_floor(height, seed):
    walker = Walker(Person(path=((1.0, 2.0),), height=height, seed=seed))
    z = heights(walker, frames_of(walker, np.array([0.0, 3.0])))
    assert z.max() == pytest.approx(height, abs=0.03)
    assert z.min() == pytest.approx(0.0, abs=0.01)


def test_who_stands_has_the_legs_side_by_side():
    walker = Walker(Person(path=((0.0, 0.0),)))
    left, right = frames_of(walker, np.array([0.0]))[SHANK : SHANK + 2, 0, 9:11]
    assert left[0] == pytest.approx(right[0], abs=1e-9)
    assert 0.1 < left[1] - right[1] < 0.25


def test_clothes_are_drawn_by_the_seed():
    colours = {tuple(colour for part in figure(1.75, seed) for _, colour in part.meshes) for seed in range(20)}
    assert len(colours) > 15
    assert [mesh[1] for mesh in figure(1.75, 3)[TRUNK].meshes] == [mesh[1] for mesh in figure(1.75, 3)[TRUNK].meshes]


@pytest.mark.parametrize("speed", [0.5, 0.8, 1.3])
def test_a_foot_on_the_floor_stands_still_at_the_persons_own_speed(speed):
    walker = Walker(Person(path=((0.0, 0.0), (40.0, 0.0)), speed=speed))
    times = np.arange(5.0, 12.0, 0.01)
    feet = frames_of(walker, times)[FOOT : FOOT + 2]
    speeds = np.linalg.norm(np.diff(feet[:, :, 9:], axis=1), axis=2) / 0.01
    assert np.mean(speeds < 0.02) == pytest.approx(0.55, abs=0.05)
    assert (speeds.min(axis=0) < 0.02).mean() > 0.95


def test_stride_and_speed_go_together_as_in_people():
    walker = Walker(Person(path=((0.0, 0.0), (40.0, 0.0)), speed=1.3))
    times = np.arange(5.0, 25.0, 0.01)
    ahead = frames_of(walker, times)[FOOT, :, 9] - frames_of(walker, times)[TRUNK, :, 9]
    strides = np.sum((ahead[:-1] < 0.0) & (ahead[1:] >= 0.0)) / 20.0
    assert 0.85 <= strides <= 1.0


def test_nothing_jumps_and_nothing_sinks_into_the_floor_on_a_whole_round():
    walker = Walker(Person(path=PATH, speed=1.2, pauses=(1.0, 0.0, 0.5)))
    frames = frames_of(walker, np.arange(0.0, 2.0 * walker.period, 0.005))
    assert np.linalg.norm(np.diff(frames[:, :, 9:], axis=1), axis=2).max() < 0.03
    assert heights(walker, frames).min() > -0.02


def test_the_round_passes_the_waypoints_at_the_speed_and_pauses_there():
    walker = Walker(Person(path=PATH, speed=1.0, pauses=(2.0, 0.0, 1.0)))
    times = np.arange(0.0, walker.period, TICK)
    places = np.array([(pose.x, pose.y) for pose in map(walker.pose, times.tolist())])
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / TICK
    assert speeds.max() == pytest.approx(1.0, rel=0.02)
    for waypoint in PATH:
        assert np.linalg.norm(places - waypoint, axis=1).min() < 0.25
    assert np.sum(speeds < 1e-6) * TICK >= 3.0


def test_a_pose_is_a_function_of_time():
    walker, other = (Walker(Person(path=PATH, seed=4)) for _ in range(2))
    times = np.array([7.0, 1.0, 7.0])
    frames = frames_of(walker, times)
    assert np.array_equal(frames[:, 0], frames[:, 2])
    assert np.array_equal(frames, frames_of(other, times))
    assert walker.pose(1.0 + walker.period).x == pytest.approx(walker.pose(1.0).x, abs=1e-9)
