"""The wheels stop, whatever becomes of the program that drives them."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hardware.emulators.channels import PtyChannel, TcpChannel
from hardware.emulators.ev3_brick import Ev3Brick
from hardware.emulators.port import Port

pytestmark = pytest.mark.wall_clock
DRIVER = """
import signal, sys
from hardware.ev3_robot import Ev3
from slam.messages import Twist
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell starts what runs behind it without one
with Ev3(ev3=sys.argv[1], lidar="").build() as robot:
    print("open", flush=True)
    while True:
        robot.drive(Twist(0.35, 0.0))
        if sys.argv[2] == "raise" and robot.read().odometry[-1:] and robot.queues["odometry"].latest.T_odom_base.x > 0.2:
            raise RuntimeError("a mistake of the caller")
        robot.clock.sleep_until(robot.clock.now() + 0.03)
"""


@pytest.mark.parametrize("way", ["tcp", "serial"])
@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGINT, "raise"])
def test_the_wheels_are_at_rest_soon_after_the_end(rollers, tmp_path, way, end):
    channel = TcpChannel() if way == "tcp" else PtyChannel(tmp_path / "brick")
    with Port(Ev3Brick(rollers, wifi=way == "tcp"), channel) as port:
        command = [sys.executable, "-c", DRIVER, port.address, str(end)]
        client = subprocess.Popen(command, cwd=Path(__file__).parents[2], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        assert client.stdout.readline() == b"open\n"
        moving = time.monotonic() + 10.0
        while min(rollers.percents[0], rollers.percents[3]) < 70 and time.monotonic() < moving and client.poll() is None:
            time.sleep(0.005)
        assert max(rollers.percents) >= 70 or end == "raise"
        if end != "raise":
            client.send_signal(end)
        else:
            client.wait(60.0)
        ended, limit = time.monotonic(), time.monotonic() + 3.0
        while any(rollers.percents) and time.monotonic() < limit:
            time.sleep(0.005)
        stopped = time.monotonic() - ended
        client.communicate()
    assert rollers.percents == [0, 0, 0, 0]
    assert stopped <= 0.6
