import math

import numpy as np
import pytest
from msgspec import structs

from sim.errors import TruthError
from sim.ground_truth import ground_truth
from sim.living import KEPT_OFF, TICK, TICK_STEPS, Living
from sim.robot import Sim
from slam.messages import Twist
from worlds.living import Door, Person
from worlds.toml_file import dump_world

FAR = (100.0, 100.0)
CROSSING = Person(path=((1.2, -1.1), (1.2, 1.1)), speed=1.0, pauses=(1.0, 1.0), seed=2)
SWINGING = Door((-1.5, 0.5), 0.0, 0.7, state="swinging", delay=0.0)


@pytest.fixture
def living_room(room, tmp_path):
    """The room with people and doors, as a file that `Sim(world=...)` takes."""

    def write(people=(), doors=()) -> str:
        path = tmp_path / "living.toml"
        path.write_text(dump_world(structs.replace(room(), people=people, doors=doors)))
        return str(path)

    return write


def after(living: Living, duration: float, robot=FAR) -> Living:
    for k in range(math.ceil(duration / TICK)):
        living.tick(k * TICK_STEPS, *robot)
    return living


def scan_of(robot, t: float):
    """A scan's points (N, 2) in the world, the robot standing at the origin, and its stamp."""
    robot.clock.sleep_until(t)
    scan = robot.read().scans[-1]
    seen = np.isfinite(scan.ranges)
    rays = np.column_stack([np.cos(scan.angles), np.sin(scan.angles), np.zeros(len(scan.angles))]) @ scan.T_base_laser.R.T
    points = (scan.ranges[seen, None] * rays[seen] + scan.T_base_laser.t)[:, :2]
    return ground_truth(robot).pose(scan.stamp).transform(points), scan.stamp


def test_a_person_whom_nobody_hinders_is_where_the_world_file_says(room):
    living = after(Living(structs.replace(room(), people=(CROSSING,))), 5.0)
    for t in (0.0, 1.234, 5.0):
        assert living.people(t)[0].as_array() == pytest.approx(living.walkers[0].pose(t).as_array(), abs=1e-9)


def test_a_person_waits_before_the_robot_and_goes_on_when_it_has_gone(room):
    world = structs.replace(room(), people=(CROSSING,))
    living = after(Living(world), 4.0, (1.2, 0.3))
    waiting, before = living.people(4.0)[0], living.people(3.5)[0]
    assert waiting.as_array() == pytest.approx(before.as_array(), abs=0.01)
    assert 0.3 - waiting.y > KEPT_OFF
    for k in range(round(4.0 / TICK), round(7.0 / TICK)):
        living.tick(k * TICK_STEPS, *FAR)
    assert living.people(7.0)[0].y > 0.9


def test_a_person_steps_back_from_a_robot_that_stays(room):
    living = after(Living(structs.replace(room(), people=(CROSSING,))), 8.0, (1.2, 0.3))
    y = [living.people(t)[0].y for t in np.arange(3.0, 8.0, 0.1)]
    assert max(y) < 0.3 - KEPT_OFF
    assert min(y) < y[0] - 0.1


def test_a_door_does_not_swing_into_the_robot(room):
    door = structs.replace(SWINGING, period=8.0)
    world = structs.replace(room(), doors=(door,))
    robot = (-1.0, 1.0)
    blocked, free = (after(Living(world), 2.0, at).frames(1.9, 1.9).values[0, 0] for at in (robot, FAR))
    assert math.dist(blocked[9:11], free[9:11]) > 0.1


def test_parts_that_come_to_the_lidars_height_are_the_legs(room):
    living = Living(structs.replace(room(), people=(CROSSING,)))
    low = living.parts_between(0.15, 0.25)
    assert 2 <= len(low) <= 4
    assert len(living.parts_between(0.0, 2.0)) == len(living.parts) == 11
    assert living.persons.tolist() == [0] * 11


def test_the_lidar_sees_two_legs_where_the_person_is(living_room):
    with Sim(world=living_room(people=(CROSSING,)), realism="ideal").build() as robot:
        points, stamp = scan_of(robot, 0.6)  # the person stands still at first
        person = ground_truth(robot).people(stamp)[0]
    hits = person.inverse().transform(points)
    legs = hits[np.linalg.norm(hits, axis=1) < 0.3]
    assert len(legs) > 15
    left, right = legs[legs[:, 1] > 0.0], legs[legs[:, 1] < 0.0]
    for leg in (left, right):
        assert np.abs(leg[:, 0]).max() < 0.12
        assert 0.02 < np.abs(leg[:, 1]).mean() < 0.15


def test_the_lidar_sees_a_walking_person_at_each_beams_own_time(living_room):
    with Sim(world=living_room(people=(CROSSING,)), realism="ideal").build() as robot:
        for t in (1.6, 2.1, 2.6):
            points, stamp = scan_of(robot, t)
            person = ground_truth(robot).people(stamp + 0.033)[0]
            near = np.linalg.norm(points - (person.x, person.y), axis=1) < 0.5
            assert near.sum() > 8
            assert np.linalg.norm(points[near].mean(axis=0) - (person.x, person.y)) < 0.3


def test_bullet_and_embree_see_the_same_standing_person(living_room):
    world = living_room(people=(Person(path=((1.2, 0.2),)),))
    scans = []
    for rays in ("embree", "bullet"):
        with Sim(world=world, realism="ideal", rays=rays).build() as robot:
            robot.clock.sleep_until(0.4)
            scans.append(robot.read().scans[-1].ranges)
    both = np.isfinite(scans[0]) & np.isfinite(scans[1])
    assert np.mean(np.abs(scans[0] - scans[1])[both] < 0.005) > 0.98


def test_the_lidar_sees_a_door_close(living_room):
    door = structs.replace(SWINGING, hinge=(1.2, -0.35), yaw=math.pi / 2, opening=-math.pi / 2, delay=0.5)
    with Sim(world=living_room(doors=(door,)), realism="ideal").build() as robot:
        ahead = len(robot.spec.lidar.angles) // 2
        robot.clock.sleep_until(0.4)
        opened = robot.read().scans[-1].ranges[ahead]
        robot.clock.sleep_until(3.0)
        closed = robot.read().scans[-1].ranges[ahead]
    assert opened - closed == pytest.approx(0.82, abs=0.02)


def test_the_robot_cannot_drive_through_a_person(living_room):
    with Sim(world=living_room(people=(Person(path=((0.6, 0.0),)),)), realism="ideal").build() as robot:
        for k in range(80):
            robot.clock.sleep_until(0.1 * k)
            robot.drive(Twist(0.2, 0.0))
        assert ground_truth(robot).pose(7.9).x < 0.55


def test_people_are_the_same_in_every_run_and_however_it_is_stepped(living_room):
    world, scans = living_room(people=(CROSSING,), doors=(SWINGING,)), []
    for step in (0.05, 0.013):
        with Sim(world=world, seed=3).build() as robot:
            t, seen = 0.0, []
            while t < 2.0:
                robot.clock.sleep_until(t)
                seen.extend(scan.ranges.tobytes() for scan in robot.read().scans)
                t += step
            scans.append(seen[:18])
    assert scans[0] == scans[1]


def test_there_is_no_truth_about_people_in_the_future(living_room):
    with Sim(world=living_room(people=(CROSSING,))).build() as robot, pytest.raises(TruthError, match="no true pose at 3"):
        ground_truth(robot).people(3.0)
