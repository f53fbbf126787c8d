from slam.messages import Imu, SensorFrame, WheelOdometry
from slam.motion.sensor_watch import SensorWatch
from slam.se2 import SE2

BOTH = frozenset({"odometry", "imu"})


def frame(stamp: float, *speaking: str, available: frozenset[str] = BOTH) -> SensorFrame:
    odometry = (WheelOdometry(stamp, SE2()),) if "odometry" in speaking else ()
    imu = (Imu(stamp, 0.0),) if "imu" in speaking else ()
    return SensorFrame(stamp, odometry, imu, available=available)


def listen(period: float, end: float, *speaking: str, available: frozenset[str] = BOTH) -> SensorWatch:
    watch = SensorWatch()
    for k in range(round(end / period) + 1):
        assert watch.silent(frame(k * period, *speaking, available=available)) == "" or len(speaking) < len(available)
    return watch


def test_sensors_that_speak_are_not_named() -> None:
    assert listen(0.1, 3.0, "odometry", "imu").silent(frame(3.1)) == ""


def test_a_sensor_that_falls_silent_is_named() -> None:
    watch = listen(0.1, 3.0, "odometry", "imu")
    assert watch.silent(frame(3.7, "odometry")) == "silent: gyro"


def test_all_that_are_silent_are_named() -> None:
    watch = listen(0.1, 3.0, "odometry", "imu")
    assert watch.silent(frame(3.7)) == "silent: wheel odometry, gyro"


def test_a_sensor_that_never_spoke_is_named_after_a_while() -> None:
    watch = listen(0.1, 0.4, "odometry")
    assert watch.silent(frame(0.4, "odometry")) == ""
    assert watch.silent(frame(0.6, "odometry")) == "silent: gyro"


def test_a_sensor_that_speaks_again_is_forgiven() -> None:
    watch = listen(0.1, 3.0, "odometry", "imu")
    watch.silent(frame(5.0, "odometry"))
    assert watch.silent(frame(5.1, "odometry", "imu")) == ""


def test_a_sensor_that_the_body_lacks_is_not_missed() -> None:
    only_wheels = frozenset({"odometry"})
    watch = listen(0.1, 3.0, "odometry", available=only_wheels)
    assert watch.silent(frame(3.1, "odometry", available=only_wheels)) == ""


def test_a_slow_sensor_is_given_the_time_it_needs() -> None:
    watch = SensorWatch()
    only_wheels = frozenset({"odometry"})
    for k in range(5):
        watch.silent(frame(3.0 * k, "odometry", available=only_wheels))
    assert watch.silent(frame(20.0, available=only_wheels)) == ""
    assert watch.silent(frame(30.0, available=only_wheels)) == "silent: wheel odometry"
