"""Every fault does what it says, and pipelines survive it."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from hardware.errors import HardwareError
from hardware.faults import (
    BeamDropout,
    ClockSkew,
    Dropped,
    FaultError,
    Faults,
    Frozen,
    HostStall,
    StuckWheel,
    Unplugged,
)
from hardware.hal import Recorded, Resettable
from hardware.recorder import Recorder
from hardware.registry import backend_class
from hardware.urdf import urdf
from scripts.runs.execute import measure
from scripts.runs.options import RunOptions
from sim.ground_truth import ground_truth
from sim.kinematic import Kinematic
from slam.messages import Status, Twist
from slam.pipelines import PIPELINES, pipeline_settings

BODY = Kinematic(realism="ideal", seed=2)
CIRCLE = Twist(0.15, 0.5)


def drive(robot, duration=1.0, twist=CIRCLE, dt=0.05):
    frames, end = [], robot.clock.now() + duration
    while robot.clock.now() < end - 1e-9:
        robot.drive(twist)
        robot.clock.sleep_until(min(robot.clock.now() + dt, end))
        frames.append(robot.read())
    return frames


def gathered(frames, channel):
    return [reading for frame in frames for reading in getattr(frame, channel)]


def readings(*faults, seed=0, **options):
    with Faults(BODY, faults, seed).build() as robot:
        return drive(robot, **options)


@pytest.fixture(scope="module")
def clean():
    with BODY.build() as robot:
        return drive(robot)


@pytest.mark.parametrize("channel", ["odometry", "imu", "scans"])
def test_an_unplugged_channel_is_silent_for_its_time_and_the_others_are_as_before(channel, clean):
    frames = readings(Unplugged(channel, start=0.3, end=0.6))
    stamps = [reading.stamp for reading in gathered(frames, channel)]
    expected = [reading.stamp for reading in gathered(clean, channel) if not 0.3 <= reading.stamp < 0.6]
    assert stamps == expected
    for other in {"odometry", "imu", "scans"} - {channel}:
        assert [reading.stamp for reading in gathered(frames, other)] == [reading.stamp for reading in gathered(clean, other)]
    assert all(frame.available == clean[0].available for frame in frames)


def test_dropped_readings_are_as_many_as_said():
    frames = readings(Dropped("imu", 0.3), duration=5.0)
    assert len(gathered(frames, "imu")) == pytest.approx(0.7 * 501, abs=40)


def test_a_frozen_device_repeats_itself_under_new_stamps(clean):
    scans = gathered(readings(Frozen("scans", start=0.35)), "scans")
    assert [scan.stamp for scan in scans] == [scan.stamp for scan in gathered(clean, "scans")]
    before = [scan for scan in scans if scan.stamp < 0.35][-1]
    for scan in scans[scans.index(before) :]:
        assert np.array_equal(scan.ranges, before.ranges, equal_nan=True)


def test_a_share_of_the_beams_drops_out(clean):
    scans = gathered(readings(BeamDropout(0.4)), "scans")
    for scan, whole in zip(scans, gathered(clean, "scans"), strict=True):
        lost = np.isnan(scan.ranges)
        assert lost.mean() == pytest.approx(0.4, abs=0.1)
        assert np.array_equal(scan.ranges[~lost], whole.ranges[~lost])


def test_a_skewed_clock_is_off_more_and_more(clean):
    frames = readings(ClockSkew("imu", offset=0.01, rate=0.1))
    for skewed, true in zip(gathered(frames, "imu"), gathered(clean, "imu"), strict=True):
        assert skewed.stamp == pytest.approx(0.01 + 1.1 * true.stamp)
        assert skewed.yaw_rate == true.yaw_rate


@pytest.mark.parametrize(("wheel", "side"), [("left", 1.0), ("right", -1.0)])
def test_a_robot_turns_about_its_stuck_wheel(wheel, side):
    with Faults(BODY, (StuckWheel(wheel, start=0.5),)).build() as robot:
        drive(robot, 0.5, Twist(0.2, 0.0))
        assert not robot.health().stalled
        frames = drive(robot, 1.0, Twist(0.2, 0.0))
        assert robot.health().stalled
        turned = ground_truth(robot.body).pose(0.6).yaw, ground_truth(robot.body).pose(1.5).yaw
    left, right = np.array(frames[-1].odometry[-1].wheel_angles) - np.array(frames[9].odometry[-1].wheel_angles)
    assert {"left": left, "right": right}[wheel] == pytest.approx(0.0, abs=0.02)
    assert side * (turned[1] - turned[0]) > 1.0


def test_a_stuck_wheel_stays_stuck_in_the_fastest_turn():
    with Faults(BODY, (StuckWheel("left"),)).build() as robot:
        commanded = robot.drive(Twist(0.3, 3.0))
        assert commanded == robot.spec.drive.limit(Twist(0.3, 3.0))
        robot.clock.sleep_until(0.4)
        assert robot.read().odometry[-1].wheel_angles[0] == 0.0


def test_what_the_host_commands_is_in_the_queue_whatever_the_wheels_do():
    robot = Faults(BODY, (StuckWheel("left"),)).build()
    commands = robot.queues["commands"].subscribe()
    with robot:
        robot.drive(Twist(0.1, 0.0))
        robot.clock.sleep_until(1.0)
    assert [command.twist for command in commands.take()] == [Twist(0.1, 0.0), Twist()]


def test_a_host_that_pauses_oversleeps_and_the_watchdog_stops_the_robot():
    robot = Faults(BODY, (HostStall(0.42, 1.0),)).build()
    commands = robot.queues["commands"].subscribe()
    with robot:
        drive(robot, 0.4, Twist(0.1, 0.0))
        robot.drive(Twist(0.1, 0.0))
        assert robot.clock.sleep_until(0.45)
        assert robot.clock.now() == pytest.approx(1.42)
        frame = robot.read()
        assert robot.clock.sleep_until(1.5)
        assert robot.clock.now() == 1.5
    assert (frame.odometry[0].stamp, frame.odometry[-1].stamp) == pytest.approx((0.4, 1.42), abs=0.021)
    assert commands.take()[-1].twist == Twist()


def test_faults_act_in_their_order_and_draw_apart():
    both = gathered(readings(BeamDropout(0.2), Dropped("imu", 0.5), seed=4), "scans")
    alone = gathered(readings(BeamDropout(0.2), seed=4), "scans")
    assert [scan.ranges.tobytes() for scan in both] == [scan.ranges.tobytes() for scan in alone]
    assert gathered(readings(Unplugged("imu"), Frozen("imu")), "imu") == []


def test_the_same_seed_gives_the_same_faults_and_after_a_reset_too():
    def kept(frames):
        return [reading.stamp for reading in gathered(frames, "imu")], [scan.ranges.tobytes() for scan in gathered(frames, "scans")]

    faults = (Dropped("imu", 0.5), BeamDropout(0.5))
    with Faults(BODY, faults, seed=1).build() as robot:
        first = kept(drive(robot))
        robot.reset(BODY.seed)
        again = kept(drive(robot))
    assert first == again == kept(readings(*faults, seed=1))
    assert first != kept(readings(*faults, seed=2))


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recording")
    with BODY.build() as robot, Recorder(robot, folder, urdf(robot.spec)) as recorder:
        for _ in range(3):
            drive(robot, 0.5)
            recorder.flush()
    return folder


def test_a_recording_can_have_faults_too(recording):
    robot = Faults(backend_class("replay")(path=recording), (Unplugged("scans", start=0.7), HostStall(0.2, 0.3))).build()
    assert isinstance(robot, Recorded)
    assert not isinstance(robot, Resettable)
    frames = []
    with robot:
        while robot.clock.sleep_until(robot.clock.now() + 0.05):
            frames.append(robot.read())
        frames.append(robot.read())
    stamps = [scan.stamp for scan in gathered(frames, "scans")]
    assert stamps
    assert max(stamps) < 0.7
    assert max(np.diff([frame.stamp for frame in frames])) == pytest.approx(0.3, abs=0.05)
    assert robot.span[1] > 1.0


def test_what_comes_through_can_be_recorded(tmp_path):
    with Faults(BODY, (Dropped("imu", 0.5),)).build() as robot, Recorder(robot, tmp_path, urdf(robot.spec)) as recorder:
        frames = drive(robot)
        recorder.flush()
    again = []
    with backend_class("replay")(path=tmp_path).build() as replay:
        while replay.clock.sleep_until(replay.clock.now() + 0.05):
            again.append(replay.read())
        again.append(replay.read())
    assert [reading.yaw_rate for reading in gathered(again, "imu")] == [reading.yaw_rate for reading in gathered(frames, "imu")]


FAULTS = {
    "scans unplugged": (Unplugged("scans", start=2.0, end=4.0), "silent: lidar"),
    "gyro unplugged": (Unplugged("imu", start=2.0, end=4.0), "silent: gyro"),
    "wheels unplugged": (Unplugged("odometry", start=2.0, end=4.0), "silent: wheel odometry"),
    "blind lidar": (BeamDropout(1.0, start=2.0, end=4.0), "the scan does not match the map"),
    "half blind lidar": (BeamDropout(0.5), ""),
    "gyro readings lost": (Dropped("imu", 0.5), ""),
    "frozen lidar": (Frozen("scans", start=2.0, end=3.0), None),
    "late lidar": (ClockSkew("scans", offset=-0.05), ""),
    "fast clock": (ClockSkew("odometry", rate=0.01), None),
    "stuck wheel": (StuckWheel("left", start=2.0, end=4.0), ""),
    "paused host": (HostStall(2.0, 1.5), ""),
}
"""What the `lidar` pipeline says of each: a reason, nothing because it need not care, or None where it cannot know."""


def reasons(pipeline: str, fault) -> tuple[list, set[str]]:
    estimator = pipeline_settings(pipeline)().build()
    with Faults(Kinematic(seed=5), (fault,), seed=5).build() as robot:
        estimates = [estimator.update(frame) for frame in drive(robot, 5.0)]
    return estimates, {estimate.reason for estimate in estimates if estimate.status is not Status.TRACKING}


@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("pipeline", PIPELINES)
def test_a_pipeline_survives_and_names_what_it_can_know(pipeline, name):
    fault, reason = FAULTS[name]
    estimates, said = reasons(pipeline, fault)
    assert all(np.isfinite(estimate.T_map_base.as_array()).all() for estimate in estimates)
    if reason and (pipeline == "lidar" or reason.startswith("silent")):
        assert reason in said
        assert estimates[-1].status is Status.TRACKING
    elif reason == "":
        assert said == set()


@pytest.mark.parametrize("name", ["scans unplugged", "wheels unplugged", "half blind lidar", "stuck wheel", "paused host"])
def test_the_lidar_pipeline_is_still_right_afterwards(name):
    record = measure(RunOptions(robot="kinematic", duration=6.0, seed=5), [FAULTS[name][0]])
    assert record.metrics["position_rmse_m"] < 0.05


def everything_of(kind: Callable[..., object], **values) -> Faults:
    return Faults(BODY, (kind(**values),))


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (lambda: everything_of(Unplugged, channel="lidar").build(), "no channel 'lidar' to be faulty; available: odometry, imu, scans"),
        (lambda: everything_of(Unplugged, channel="commands").build(), "no channel 'commands'"),
        (lambda: everything_of(BeamDropout, share=1.1), "BeamDropout.share must be within 0 and 1, got 1.1"),
        (lambda: everything_of(Dropped, channel="imu", share=math.nan), "Dropped.share must be within 0 and 1, got nan"),
        (lambda: everything_of(Frozen, channel="scans", start=3.0, end=2.0), "got 3.0 to 2.0"),
        (lambda: everything_of(HostStall, start=1.0, duration=0.0), "HostStall.duration must be above 0, got 0.0"),
        (lambda: everything_of(StuckWheel, wheel="front"), "StuckWheel.wheel must be left or right, got 'front'"),
        (lambda: Faults(BODY, seed=-1), "must be 0 or above, got -1"),
    ],
)
def test_a_fault_that_cannot_be_says_so(make, problem):
    with pytest.raises(FaultError, match=problem) as caught:
        make()
    assert isinstance(caught.value, HardwareError)
