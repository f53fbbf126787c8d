import math
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hardware.camera_spec import d435
from hardware.drivers import realsense
from hardware.drivers.errors import DeviceError, LinkError
from hardware.drivers.realsense import USUAL_DELAY, RealSenseDriver, StampClock, believed, metres
from hardware.emulators.channels import TcpChannel
from hardware.emulators.d435 import D435
from hardware.emulators.port import Port
from hardware.ev3_robot import camera_finder
from hardware.queues import EventQueue
from hardware.spec import RobotSpec
from slam.depth_images import aligned_depth
from slam.messages import RgbdImage
from slam.se3 import SE3

ROLLED = SE3.from_xyz_rpy((0.015, 0.0, 0.0), (0.0, 0.0, 0.05))
"""About the optical axis: the vendor's alignment passes depths on as they are, other turns would change them."""
SPEC = RobotSpec(camera=replace(d435((424, 240), (424, 240), 30), T_colour_depth=ROLLED))


class Studio:
    """Takes pictures of a plane that stands at a slant, at a steady rate, on a clock of its own."""

    def __init__(self):
        self.frozen = False
        self.taken = {}
        self._due = time.monotonic()

    def next_image(self):
        now = time.monotonic()
        if self.frozen or now < self._due:
            return None
        self._due = max(self._due + SPEC.camera.period, now)
        colour = np.zeros((240, 424, 3), np.uint8)
        colour[..., 0] = np.arange(424) // 2
        colour[..., 1] = np.arange(240)[:, None]
        depth = np.tile(np.linspace(0.8, 2.0, 424, dtype=np.float32), (240, 1))
        depth[:10] = np.nan
        image = RgbdImage(now - 0.02, colour, depth, *SPEC.camera_infos())
        self.taken[round(image.stamp, 4)] = image
        return image


@pytest.fixture
def studio():
    return Studio()


@pytest.fixture
def port(studio):
    pytest.importorskip("libusb_package", reason="the vendor's library is not installed")
    with Port(D435(studio.next_image, time.monotonic, SPEC.camera), TcpChannel()) as port:
        yield port


def driver_at(address, spec=SPEC):
    images = EventQueue()
    return RealSenseDriver(address, spec, images, camera_finder(address)), images.subscribe()


def gathered(inbox, count, patience=8.0):
    found, end = [], time.monotonic() + patience
    while len(found) < count and time.monotonic() < end:
        found += inbox.take()
        time.sleep(0.01)
    assert len(found) >= count
    return found


@pytest.mark.wall_clock
def test_images_come_as_they_were_taken_on_the_hosts_clock(port, studio):
    driver, inbox = driver_at(port.address)
    with_driver = time.monotonic()
    driver.open()
    try:
        images = gathered(inbox, 20)
    finally:
        driver.close()
    stamps = np.array([image.stamp for image in images])
    assert np.all(np.diff(stamps) > 0.0)
    true = np.array(sorted(studio.taken))
    errors = [np.abs(true - stamp).min() for stamp in stamps]
    assert np.median(errors) < 0.005
    assert stamps[0] > with_driver - 1.0
    sent = studio.taken[true[np.abs(true - stamps[5]).argmin()]]
    assert np.array_equal(images[5].colour, sent.colour)
    assert np.nanmax(np.abs(images[5].depth - sent.depth)) < 0.00051
    assert np.array_equal(np.isnan(images[5].depth), np.isnan(sent.depth))
    for told, known in zip((images[0].colour_info, images[0].depth_info), SPEC.camera_infos(), strict=True):
        assert np.allclose(told.K, known.K, rtol=1e-6)
        assert np.allclose(told.T_base_camera.t, known.T_base_camera.t, atol=1e-6)
        assert np.allclose(told.T_base_camera.R, known.T_base_camera.R, atol=1e-6)
    assert not driver.link


@pytest.mark.wall_clock
def test_the_vendors_alignment_agrees_with_ours(port):
    driver, inbox = driver_at(port.address, RobotSpec(camera=d435((424, 240), (424, 240), 30)))  # the turn comes from the camera
    camera = camera_finder(port.address)()
    sdk = realsense.load_sdk()
    session = realsense.RealSenseSession(camera, SPEC, EventQueue().put)
    try:
        end, frames = time.monotonic() + 5.0, None
        while frames is None and time.monotonic() < end:
            came, found = session._pipeline.try_wait_for_frames(100)
            frames = found if came and found.size() == 2 else None
        theirs = metres(np.asanyarray(sdk.align(sdk.stream.color).process(frames).get_depth_frame().get_data()), 0.001)
    finally:
        session.close()
    driver.open()
    try:
        ours = aligned_depth(gathered(inbox, 1)[0])
    finally:
        driver.close()
    both = np.isfinite(theirs) & np.isfinite(ours)
    assert both.mean() > 0.6
    assert np.median(np.abs(theirs - ours)[both]) < 0.002


@pytest.mark.wall_clock
def test_a_camera_that_repeats_itself_or_falls_silent_is_lost_and_found_again(port, studio):
    driver, inbox = driver_at(port.address)
    driver.open()
    try:
        gathered(inbox, 3)
        studio.frozen = True
        end = time.monotonic() + 4.0
        while driver.losses == 0 and time.monotonic() < end:
            time.sleep(0.02)
        assert driver.losses == 1
        inbox.take()
        studio.frozen = False
        gathered(inbox, 3)
        port.unplug()
        while driver.losses == 1 and time.monotonic() < end + 4.0:
            time.sleep(0.02)
        port.replug()
        inbox.take()
        gathered(inbox, 3)
    finally:
        driver.close()


@pytest.mark.wall_clock
def test_garbage_on_the_wire_is_no_image(port):
    driver, inbox = driver_at(port.address)
    driver.open()
    try:
        gathered(inbox, 3)
        port.disturbed = lambda message: message[:-1] + bytes([message[-1] ^ 1])
        time.sleep(0.3)
        inbox.take()
        time.sleep(0.3)
        assert inbox.take() == []
        port.disturbed = bytes
        gathered(inbox, 3)
    finally:
        driver.close()


@pytest.mark.wall_clock
def test_a_mode_that_the_camera_does_not_have_is_an_error(port):
    driver, _ = driver_at(port.address, RobotSpec(camera=d435((640, 480), (640, 480), 30)))
    with pytest.raises(DeviceError, match="does not stream"):
        driver.open()


def test_nothing_plugged_in_is_an_error():
    pytest.importorskip("libusb_package", reason="the vendor's library is not installed")
    with pytest.raises(LinkError, match="RealSense"):
        camera_finder("usb:123")()
    with pytest.raises(LinkError, match="no RealSense is plugged in"):
        camera_finder("usb")()


@pytest.mark.parametrize("address", ["bluetooth", "", "/dev/video0"])
def test_an_address_that_is_none_is_an_error(address):
    with pytest.raises(DeviceError, match="write usb"):
        camera_finder(address)


def test_a_library_that_is_missing_is_an_error_that_says_what_to_install(monkeypatch):
    from hardware.drivers import realsense_sdk

    def missing(name):
        raise ModuleNotFoundError(f"No module named '{name}'")

    monkeypatch.setattr(realsense_sdk.importlib, "import_module", missing)
    with pytest.raises(DeviceError, match=r"pip install 'bricktwin\[realsense\]'"):
        realsense_sdk.load_sdk()

    def broken(name):
        raise ImportError(f"{name}: cannot open shared object file")

    monkeypatch.setattr(realsense_sdk.importlib, "import_module", broken)
    with pytest.raises(DeviceError, match="shared object"):
        realsense_sdk.load_sdk()


def test_stamps_of_the_cameras_own_clock_go_by_the_quickest_arrival():
    clock = StampClock("global")
    rng = np.random.default_rng(1)
    for k in range(100):
        stamp = 50.0 + k / 15.0
        arrival = stamp + 700.0 + USUAL_DELAY + rng.exponential(0.01)
        found = clock.host_time(1e3 * stamp, "hardware", arrival)
    assert found == pytest.approx(stamp + 700.0, abs=0.002)
    assert clock.host_time(1e3 * time.time(), "global", 0.0) == pytest.approx(time.monotonic(), abs=0.01)


def test_the_data_sheet_gives_way_to_the_factory_and_not_a_calibration():
    imager = d435().colour
    told = SimpleNamespace(model="distortion.inverse_brown_conrady", coeffs=[0.1, 0, 0, 0, 0], fx=610.0, fy=611.0, ppx=420.0, ppy=239.0)
    factory = believed(imager, told)
    assert (factory.focal, factory.centre, factory.distortion[0]) == ((610.0, 611.0), (420.0, 239.0), 0.1)
    calibrated = replace(imager, centre=(421.0, 240.0))
    assert believed(calibrated, told) == calibrated
    with pytest.raises(DeviceError, match="ftheta"):
        believed(imager, SimpleNamespace(**{**vars(told), "model": "distortion.ftheta"}))


def test_steps_of_zero_are_no_depth():
    depth = metres(np.array([[0, 1000]], np.uint16), 0.001)
    assert math.isnan(depth[0, 0])
    assert depth[0, 1] == pytest.approx(1.0)
