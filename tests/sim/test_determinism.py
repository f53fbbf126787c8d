import subprocess
import sys
from pathlib import Path

from sim.robot import Sim
from slam.messages import Twist

PROGRAM = """
import hashlib, sys
from sim.robot import Sim
from slam.messages import Twist

digest = hashlib.sha256()
with Sim(seed=int(sys.argv[1])).build() as robot:
    for k in range(40):
        robot.clock.sleep_until(0.05 * k)
        frame = robot.read()
        digest.update(repr((frame.stamp, frame.odometry, frame.imu)).encode())
        for scan in frame.scans:
            digest.update(scan.ranges.tobytes())
        robot.drive(Twist(0.25, 1.0 if k % 20 < 10 else -1.0))
print(digest.hexdigest())
"""


def fresh_process(seed: int) -> str:
    command = [sys.executable, "-c", PROGRAM, str(seed)]
    root = Path(__file__).parents[2]
    return subprocess.run(command, capture_output=True, text=True, check=True, cwd=root).stdout.splitlines()[-1]


def readings(robot, duration=1.0):
    result, t = [], 0.0
    while t < duration:
        robot.clock.sleep_until(t)
        frame = robot.read()
        result.append((frame.odometry, frame.imu, [scan.ranges.tobytes() for scan in frame.scans]))
        robot.drive(Twist(0.2, 0.7))
        t += 0.1
    return result


def test_the_same_seed_gives_the_same_bits_in_fresh_processes():
    first, second, other = fresh_process(7), fresh_process(7), fresh_process(8)
    assert first == second
    assert first != other


def test_a_reset_gives_the_same_bits_as_a_fresh_robot():
    with Sim(seed=5).build() as robot:
        fresh = readings(robot)
        robot.reset(6)
        other = readings(robot)
        robot.reset(5)
        again = readings(robot)
    assert again == fresh
    assert other != fresh


def test_resets_leave_no_memory_behind():
    def resident() -> float:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return pages * 4096 / 1e6

    with Sim().build() as robot:
        for seed in range(30):
            robot.reset(seed)
        before = resident()
        for seed in range(60):
            robot.reset(seed)
        assert resident() - before <= 3.0
