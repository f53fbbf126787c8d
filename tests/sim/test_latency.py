import math

import numpy as np
import pytest

from hardware.hal import WATCHDOG
from sim.channels import Channel, ChannelErrors
from sim.ground_truth import ground_truth
from sim.robot import Sim
from slam.messages import Twist


def delays(errors, count=4000, spacing=1.0):
    """How late events arrive [s] that are sent so far apart [s] that none waits for another."""
    channel, result = Channel(errors, np.random.default_rng(0)), []
    for k in range(count):
        channel.send(spacing * k, k)
        due = channel.due
        if channel.arrived(math.inf):
            result.append(due - spacing * k)
    return np.array(result)


def test_a_perfect_channel_delivers_at_once():
    assert np.all(delays(ChannelErrors()) == 0.0)


def test_delays_have_the_documented_mean_and_spread():
    late = delays(ChannelErrors(latency=0.040, jitter=0.010))
    assert late.mean() == pytest.approx(0.040, abs=0.001)
    assert late.std() == pytest.approx(0.010, rel=0.05)


def test_some_are_held_up_for_longer():
    late = delays(ChannelErrors(latency=0.040, tail_share=0.1, tail=0.05))
    assert np.mean(late > 0.0401) == pytest.approx(0.1, abs=0.02)
    assert late.mean() == pytest.approx(0.045, abs=0.001)


def test_a_share_never_arrives():
    assert len(delays(ChannelErrors(drop=0.3))) == pytest.approx(2800, rel=0.05)


def test_nothing_overtakes():
    channel = Channel(ChannelErrors(latency=0.05, jitter=0.05, tail_share=0.2, tail=0.2), np.random.default_rng(1))
    for k in range(200):
        channel.send(0.01 * k, k)
    assert channel.arrived(math.inf) == list(range(200))


def frames(realism, duration=1.0, tick=0.01):
    result = []
    with Sim(world="corridor", realism=realism).build() as robot:
        while robot.clock.now() < duration:
            robot.clock.sleep_until(robot.clock.now() + tick)
            result.append(robot.read())
    return result


@pytest.mark.parametrize("channel", ["odometry", "imu", "scans"])
def test_readings_come_later_with_the_stamps_of_their_measurement(channel):
    prompt, late = (frames(realism) for realism in ("ideal", f"ideal:{channel}.latency=0.1"))
    first, then = ([(reading.stamp, frame.stamp) for frame in run for reading in getattr(frame, channel)] for run in (prompt, late))
    assert [stamp for stamp, _ in then] == [stamp for stamp, _ in first][: len(then)]
    waits = [arrival - stamp for stamp, arrival in then]
    assert min(waits) >= 0.1
    assert len(then) < len(first)


def test_losing_readings_of_one_channel_leaves_the_others_alone():
    whole, some = (frames(realism) for realism in ("datasheet", "datasheet:odometry.drop=0.5"))
    assert sum(len(frame.odometry) for frame in some) < 0.7 * sum(len(frame.odometry) for frame in whole)
    assert [frame.imu for frame in some] == [frame.imu for frame in whole]


def motion_begins(latency):
    with Sim(world="corridor", realism=f"ideal:commands.latency={latency}").build() as robot:
        robot.drive(Twist(0.3, 0.0))
        robot.clock.sleep_until(0.4)
        truth = ground_truth(robot)
        moved = [abs((truth.pose(0.0).inverse() @ truth.pose(t)).x) > 1e-5 for t in np.arange(0.0, 0.4, 0.002).tolist()]
    return 0.002 * moved.index(True)


def test_a_command_is_obeyed_when_it_arrives():
    assert motion_begins(0.1) == pytest.approx(motion_begins(0.0) + 0.1, abs=0.0021)


def test_the_watchdog_counts_from_the_arrival():
    with Sim(world="corridor", realism="ideal:commands.latency=0.2").build() as robot:
        stops = robot.queues["commands"].subscribe()
        robot.drive(Twist(0.1, 0.0))
        robot.clock.sleep_until(1.0)
        assert [command.stamp for command in stops.take()] == pytest.approx([0.0, 0.2 + WATCHDOG])


def test_a_lost_command_is_not_obeyed():
    with Sim(world="corridor", realism="ideal:commands.drop=1").build() as robot:
        robot.drive(Twist(0.3, 0.0))
        robot.clock.sleep_until(0.5)
        assert abs((ground_truth(robot).pose(0.0).inverse() @ ground_truth(robot).pose(0.5)).x) < 1e-4


def test_latency_does_not_depend_on_how_the_sleep_is_cut():
    finals = []
    for tick in (0.007, 0.05):
        with Sim(seed=3, realism="harsh").build() as robot:
            readings = []
            while robot.clock.now() < 0.7:
                robot.clock.sleep_until(min(robot.clock.now() + tick, 0.7))
                readings += robot.read().imu
            finals.append(readings)
    assert finals[0] == finals[1]
