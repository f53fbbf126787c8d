"""Marker maps from sightings alone: found, voted, polished; and what is wrong with a marker is noticed."""

from __future__ import annotations

import dataclasses
import math
from itertools import pairwise

import numpy as np
import pytest

from scripts.bench.marker_scenes import MOUNT, MarkerScene, map_errors
from slam.kernels.planar_pose import rotation
from slam.landmarks.marker_bundle import Bundle, Prior, views_of
from slam.landmarks.marker_chain import MarkerChain
from slam.landmarks.marker_graph import FIXED, MarkerGraph, MarkerGraphSettings
from slam.landmarks.marker_location import MarkerField
from slam.landmarks.marker_map import MappedMarker, MarkerMap
from slam.landmarks.odometry_scales import OdometryScales
from slam.landmarks.sighting import Sighting
from slam.motion.motion_noise import MotionNoise
from slam.se2 import SE2
from slam.se3 import SE3

SCENE = MarkerScene(count=24)


def driven(path: list[SE2], seen: list[list[Sighting]], seed: int = 3) -> MarkerGraph:
    """The loop of `visual_slam`, with every image a keyframe."""
    graph, noise = MarkerGraph(MarkerGraphSettings(), MOUNT, MotionNoise()), MotionNoise()
    steps = [SE2(), *SCENE.steps(path, np.random.default_rng(seed))]
    pose, covariance = path[0], np.eye(3) * 1e-10
    for step, sightings in zip(steps, seen, strict=True):
        covariance, pose = noise.propagate(covariance, pose, step), pose @ step
        known, fitting = graph.known.known(sightings), sightings
        if known:
            found = graph.known.locate(known, Prior(pose.as_array(), np.linalg.inv(covariance + np.eye(3) * 1e-10)))
            pose, covariance = (found.T_map_base, found.covariance) if found.believable else (pose, covariance)
            graph.watch(known, found)
            misfits = {s.id for s, fits in zip(known, found.fits, strict=True) if not fits}
            fitting = [s for s in sightings if s.id not in misfits]
        if graph.add(pose, covariance, step, fitting):
            pose, covariance = graph.keyframes[-1].T_map_base, graph.keyframes[-1].covariance
    return graph


@pytest.fixture(scope="module")
def path() -> list[SE2]:
    return SCENE.path(90)


@pytest.fixture(scope="module")
def seen(path: list[SE2]) -> list[list[Sighting]]:
    rng = np.random.default_rng(1)
    return [SCENE.sightings(pose, rng) for pose in path]


@pytest.fixture(scope="module")
def lap(path: list[SE2], seen: list[list[Sighting]]) -> MarkerGraph:
    graph = driven(path, seen)
    graph.batch(30)
    return graph


def test_a_lap_gives_a_map_right_to_millimetres(lap: MarkerGraph) -> None:
    off, turned = map_errors(lap.map("d"), SCENE.truth())
    assert len(off) == SCENE.count
    assert np.sqrt(np.mean(off**2)) < 0.004
    assert np.median(turned) < math.radians(0.3)
    assert not lap.alarms


def test_the_graph_is_ten_times_as_good_as_the_chain(lap: MarkerGraph, seen: list[list[Sighting]]) -> None:
    chain = MarkerChain()
    for sightings in seen:
        chain.update(sightings)
    worse, _ = map_errors(chain.map("d"), SCENE.truth())
    better, _ = map_errors(lap.map("d"), SCENE.truth())
    assert np.sqrt(np.mean(worse**2)) > 10.0 * np.sqrt(np.mean(better**2))


def test_the_chain_follows_the_report() -> None:
    truth = SCENE.truth()
    a, b, c = truth.markers[0], truth.markers[1], truth.markers[2]

    def shown(*markers: MappedMarker) -> list[Sighting]:
        zero = np.zeros((4, 2))
        return [
            Sighting(m.id, m.size, zero, zero, np.zeros((4, 2, 2)), (m.T_map_marker, m.T_map_marker), (0.0, 1.0), 9.0 - m.id, 0.5)
            for m in markers
        ]

    chain = MarkerChain()
    chain.update(shown(a, b))
    chain.update(shown(b, c))
    assert chain.update(shown(MappedMarker(9, 0.1, SE3()))) is None
    for marker in (a, b, c):
        expected = a.T_map_marker.inverse() @ marker.T_map_marker
        np.testing.assert_allclose(chain.markers[marker.id].T_map_marker.matrix(), expected.matrix(), atol=1e-12)


def test_wrong_ids_do_not_spoil_the_map(path: list[SE2], seen: list[list[Sighting]]) -> None:
    rng = np.random.default_rng(7)
    spoilt = [[dataclasses.replace(s, id=int(rng.integers(SCENE.count))) if rng.random() < 0.2 else s for s in frame] for frame in seen]
    once = [[s for s in frame if [o.id for o in frame].count(s.id) == 1] for frame in spoilt]
    graph = driven(path, once)
    graph.batch(30)
    off, _ = map_errors(graph.map("d"), SCENE.truth())
    assert np.percentile(off, 95) < 0.015
    assert len(off) > 0.8 * SCENE.count


def test_a_marker_that_moves_raises_an_alarm_within_five_frames_and_the_map_stays(path: list[SE2], seen: list[list[Sighting]]) -> None:
    rng = np.random.default_rng(8)
    twice, frames = [*path, *path], [*seen]
    truth = dict(SCENE.truth().markers)
    moved = dataclasses.replace(truth[3], T_map_marker=SE3(np.eye(3), np.array([0.0, 0.15, 0.1])) @ truth[3].T_map_marker)
    after = MarkerMap.of([*(m for k, m in truth.items() if k != 3), moved], "d")
    frames += [SCENE.sightings(pose, rng, after) for pose in path]
    first = next(k for k in range(len(path), len(frames)) if any(s.id == 3 for s in frames[k]))
    until = first + 5
    assert "has moved" in driven(twice[:until], frames[:until]).alarms.get(3, "")
    graph = driven(twice, frames)
    graph.batch(30)
    off, _ = map_errors(graph.map("d"), after)
    assert off.max() < 0.012
    assert list(graph.alarms) == [3]


def test_the_mount_is_found_with_the_map(path: list[SE2], seen: list[list[Sighting]], lap: MarkerGraph) -> None:
    tilted = SE3(rotation(np.array([0.004, -0.006, 0.0])) @ MOUNT.R, MOUNT.t)
    graph = MarkerGraph(MarkerGraphSettings(), tilted, MotionNoise())
    for pose, sightings, step in zip(path, seen, [SE2(), *SCENE.steps(path, np.random.default_rng(3))], strict=True):
        graph.add(pose, np.eye(3) * 1e-6, step, sightings)
    graph.batch(30)
    off = SE3(graph.known.mount.R @ MOUNT.R.T).log()[3:]
    assert np.abs(off[:2]).max() < 0.001


def test_markers_of_a_wrong_size_make_the_map_doubtful(path: list[SE2], seen: list[list[Sighting]], lap: MarkerGraph) -> None:
    assert not lap.suspicion
    assert 0.99 < lap.scales.distance < 1.01
    wrong = [[dataclasses.replace(s, size=1.3 * s.size, branches=tuple(SE3(b.R, 1.3 * b.t) for b in s.branches)) for s in f] for f in seen]  # type: ignore[arg-type]
    graph = driven(path, wrong)
    graph.batch(30)
    assert "size" in graph.suspicion


def test_a_gyro_that_turns_too_little_is_put_right() -> None:
    path = SCENE.path(60)
    steps = np.array([(a.inverse() @ b).as_array() for a, b in pairwise(path)])
    poses = np.array([pose.as_array() for pose in path])
    assert OdometryScales.fitted(poses, steps * [1.0, 1.0, 0.98]).turn == pytest.approx(1.0 / 0.98, abs=1e-3)


def test_one_image_is_enough_to_find_the_robot(path: list[SE2], seen: list[list[Sighting]]) -> None:
    field = MarkerField.empty(MOUNT)
    for marker in SCENE.truth().markers.values():
        field.put(marker.id, marker.T_map_marker, np.zeros((6, 6)))
    for pose, sightings in zip(path[::9], seen[::9], strict=True):
        found = field.relocate(sightings)
        assert found is not None
        off = pose.inverse() @ found.T_map_base
        assert math.hypot(off.x, off.y) < 0.003
        error = np.array([found.T_map_base.x - pose.x, found.T_map_base.y - pose.y, off.yaw])
        assert error @ np.linalg.solve(found.covariance, error) < 25.0


def test_a_bundle_without_noise_is_exact(path: list[SE2]) -> None:
    rng, exact = np.random.default_rng(0), MarkerScene(count=12, noise=1e-6)
    poses = path[::6]
    seen = [(k, s) for k, pose in enumerate(poses) for s in exact.sightings(pose, rng)]
    truth = exact.truth()
    R = np.array([rotation(rng.normal(0.0, 0.02, 3)) @ m.T_map_marker.R for m in truth.markers.values()])
    t = np.array([m.T_map_marker.t + rng.normal(0.0, 0.02, 3) for m in truth.markers.values()])
    start = np.array([pose.as_array() for pose in poses])
    steps = np.array([(a.inverse() @ b).as_array() for a, b in pairwise(poses)])
    guess = start + np.vstack([np.zeros(3), rng.normal(0.0, 0.01, (len(poses) - 1, 3))])
    views = views_of([s for _, s in seen], [k for k, _ in seen], [s.id for _, s in seen])
    weaker = (*views[:3], views[3] * 1e-8, views[4])
    information = np.tile(np.eye(3) * 1e6, (len(steps), 1, 1))
    bundle = Bundle(guess, R, t, MOUNT, weaker, (steps, information), Prior(start[0], FIXED), np.ones(12, np.bool_))
    bundle.solve(30)
    seen_often = np.bincount(views[1], minlength=12) >= 2
    assert np.abs(bundle.translations - [m.T_map_marker.t for m in truth.markers.values()])[seen_often].max() < 1e-5
    off = bundle.poses - start
    assert np.abs(np.remainder(off[:, 2] + math.pi, math.tau) - math.pi).max() < 1e-6
    assert np.abs(off[:, :2]).max() < 1e-5


def test_same_sightings_same_bits(path: list[SE2], seen: list[list[Sighting]]) -> None:
    a, b = driven(path[:30], seen[:30]), driven(path[:30], seen[:30])
    np.testing.assert_array_equal(a.known.translations, b.known.translations)
    np.testing.assert_array_equal(a.known.covariances, b.known.covariances)
