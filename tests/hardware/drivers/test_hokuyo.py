import time

import numpy as np
import pytest

from hardware.drivers.errors import DeviceError, LinkError
from hardware.drivers.hokuyo import HokuyoDriver
from hardware.emulators.channels import PtyChannel, TcpChannel
from hardware.emulators.port import Port
from hardware.emulators.urg_lidar import Turn, UrgLidar
from hardware.queues import EventQueue
from hardware.spec import LidarSpec

pytestmark = pytest.mark.wall_clock
SPEC = LidarSpec()
CODES = np.array([0, 7, 19, 20, 5600])


class Mirror:
    """Turns with the host's clock; its ranges tell which turn they are of."""

    def __init__(self):
        self.start = time.monotonic()

    def now(self):
        return time.monotonic() - self.start

    def turn(self):
        number = int((self.now() - 0.101) * 10.0)
        ranges = np.full(682, 1000 + number % 1000)
        ranges[: len(CODES)] = CODES
        return Turn(number / 10.0, ranges) if number >= 0 else None


@pytest.fixture
def mirror():
    return Mirror()


@pytest.fixture(params=["tcp", "serial"])
def port(request, mirror, tmp_path):
    channel = TcpChannel() if request.param == "tcp" else PtyChannel(tmp_path / "lidar")
    with Port(UrgLidar(mirror.turn, mirror.now, zero_ms=(1 << 24) - 800), channel) as port:
        yield port


@pytest.fixture
def scans():
    return EventQueue()


def take(inbox, count, seconds=5.0):
    found, end = [], time.monotonic() + seconds
    while len(found) < count and time.monotonic() < end:
        found += inbox.take()
        time.sleep(0.01)
    return found


def check(found, mirror):
    """Every reading is of a turn that there was, at its time."""
    for scan in found:
        number = round((scan.stamp - mirror.start - 44 * SPEC.time_increment) * 10.0)
        assert scan.stamp - mirror.start - 44 * SPEC.time_increment == pytest.approx(number / 10.0, abs=0.005)
        assert np.allclose(scan.ranges[5:], 1.0 + number % 1000 * 1e-3, atol=1e-6)
        np.testing.assert_array_equal(scan.ranges[:5], [np.inf, np.nan, np.nan, 0.02, 5.6])


def test_scans_come_whole_in_order_and_with_their_times(port, mirror, scans):
    inbox, driver = scans.subscribe(), HokuyoDriver(port.address, SPEC, scans)
    driver.open()
    found = take(inbox, 12)
    driver.close()
    check(found, mirror)
    assert np.allclose(np.diff([scan.stamp for scan in found]), 0.1, atol=0.002)
    assert np.array_equal(found[0].angles, SPEC.angles)
    assert found[0].time_increment == pytest.approx(SPEC.time_increment)


def test_a_lidar_that_still_streams_for_a_client_that_was_killed_is_taken_over(port, mirror, scans):
    inbox = scans.subscribe()
    first = HokuyoDriver(port.address, SPEC, scans)
    session = first._connect()
    session._transport.close()
    driver = HokuyoDriver(port.address, SPEC, scans)
    driver.open()
    check(take(inbox, 3), mirror)
    driver.close()


@pytest.mark.parametrize("fault", ["unplug", "silence"])
def test_it_is_back_within_two_seconds(port, mirror, scans, fault):
    inbox, driver = scans.subscribe(), HokuyoDriver(port.address, SPEC, scans)
    driver.open()
    check(take(inbox, 2), mirror)
    if fault == "unplug":
        port.unplug()
    port.silent = True
    end = time.monotonic() + 3.0
    while driver.link and time.monotonic() < end:
        time.sleep(0.01)
    assert not driver.link
    assert driver.losses == 1
    inbox.take()
    port.silent = False
    port.replug()
    back = time.monotonic()
    found = take(inbox, 1)
    assert time.monotonic() - back < 2.0 + 0.2
    check(found, mirror)
    driver.close()


def test_no_broken_scan_is_passed_on(port, mirror, scans):
    inbox, driver = scans.subscribe(), HokuyoDriver(port.address, SPEC, scans)
    driver.open()
    broken = iter(range(10**6))

    def disturbed(answer):
        k = next(broken)
        place = 37 * k % len(answer)
        return [answer, answer[:place], answer[:place] + b"~" + answer[place + 1 :], answer[place:], b"\n\n" + answer][k % 5]

    port.disturbed = disturbed
    check(take(inbox, 10, 6.0), mirror)
    port.disturbed = bytes
    assert take(inbox, 3)
    driver.close()


def test_another_lidar_than_the_specifications_is_an_error(port, scans):
    with pytest.raises(DeviceError, match=r"682 beams .* says 681"):
        HokuyoDriver(port.address, LidarSpec(beams=681), scans).open()


@pytest.mark.parametrize("address", ["/nonexistent/port", "tcp:127.0.0.1:9", "tcp:127.0.0.1:99999999"])
def test_a_lidar_that_is_not_there_is_an_error_with_a_remedy(address, scans):
    with pytest.raises(DeviceError, match=";") as caught:
        HokuyoDriver(address, SPEC, scans).open()
    assert "\n" not in str(caught.value)


def test_a_port_at_which_nobody_answers_is_no_lidar(tmp_path, scans):
    class Mute:
        def attach(self):
            pass

        def tick(self):
            pass

        def exchange(self, received):
            return b""

    with Port(Mute(), PtyChannel(tmp_path / "mute")) as port, pytest.raises(LinkError, match="no answer to PP"):
        HokuyoDriver(port.address, SPEC, scans).open()
