"""The twin behind the emulated devices: what the brick's motors do and its sensors feel, what the lidar sees, as time goes by."""

from __future__ import annotations

import logging
import math
import threading
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from hardware.emulators.urg_lidar import UG01, Turn
from hardware.openable import Openable
from hardware.protocols import ev3_direct, scip_sweep
from hardware.queues import EventQueue
from sim.motion import STEP, WHEELS
from sim.motor_kernel import PERCENT_RATE
from sim.simulation import Simulation
from sim.twin import Twin
from slam.messages import Imu, LaserScan, RgbdImage, Trajectory
from slam.se2 import SE2
from worlds.loader import load_world

_log = logging.getLogger(__name__)
BEAT = 0.004
"""Longest time between two looks at the clock [s]."""
NOT_OF_THE_BODY = "drive.ramp=1e6,imu.latency=0,imu.jitter=0,imu.tail_share=0,imu.drop=0"
"""What the twin does for the link and the program on the brick; here the real driver and the emulator do it."""
AT_ONCE = 1.0
"""Most of the time that has passed is caught up with at once [s]: on a machine that is too slow the twin lags, and still answers."""
LATE = 0.5
"""A twin that is so far behind is told of [s]."""
WAITING = 3
"""Turns of the lidar, and images, that are kept for a client."""
VOLTS, AMPERES = 8.0, 0.2
"""Of a twin without a battery."""
REHEARSAL = 0.2
"""Time for each motion of a rehearsal: two turns of the lidar [s]."""
EVERY = 5
"""Physics steps from one true pose to the next."""


class Wiring(NamedTuple):
    """What is plugged into the brick where."""

    left: int = 0
    """Output of the left motor, A is 0."""
    right: int = 3
    """Output of the right motor."""
    gyro: int | None = 3
    """Input of the gyro, the first is 0; None: there is none."""
    reversed: bool = False
    """The motors are mounted the other way round: counting up moves the robot backwards."""


def on_the_wire(realism: str) -> str:
    """The realism of a body whose link and brick are emulated."""
    return f"{realism}{',' if ':' in realism else ':'}{NOT_OF_THE_BODY}"


class WiredTwin(Openable):
    """A twin that follows a clock, from `open` to `close`.

    It is the `Body` of an emulated brick and the source of an emulated lidar and camera.
    """

    def __init__(self, twin: Twin, clock: Callable[[], float], wiring: Wiring | None = None) -> None:
        """Wire it up.

        Args:
            twin: the parameters of a twin, its realism made by `on_the_wire`.
            clock: the host's monotonic clock [s].
            wiring: motors at A and D and the gyro at 4 unless it says else.
        """
        self._twin = twin
        self._clock = clock
        self._wiring = wiring or Wiring()
        self._outputs = (self._wiring.left, self._wiring.right)
        self._sign = -1 if self._wiring.reversed else 1
        self._lock = threading.RLock()
        self._queues = _queues()
        self._inbox = {name: self._queues[name].subscribe() for name in ("imu", "scans", "images")}
        self._turns: deque[Turn] = deque(maxlen=WAITING)
        self._images: deque[RgbdImage] = deque(maxlen=WAITING)
        self._goals = [0.0, 0.0]
        self._rate_deg = 0.0
        self._angle_deg = 0.0
        self._told = 0
        self._late = False
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None
        self._simulation: Simulation | None = None
        self.start = 0.0
        """Time zero of the twin on the host's clock [s]."""

    @property
    def simulation(self) -> Simulation:
        """The episode."""
        assert self._simulation is not None
        return self._simulation

    def open(self) -> None:
        """Start the twin and its clock, once every kernel is compiled: nobody waits for one while the robot drives.

        Raises:
            WorldError, SimError: it cannot be simulated.
        """
        world = load_world(self._twin.world)
        _rehearse(self._twin.simulate(world, self._twin.seed))
        self._simulation = self._twin.simulate(world, self._twin.seed)
        self.start = self._clock()
        self._thread = threading.Thread(target=self._follow, name="twin", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop; the truth stays. May be called twice."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join()
        self.simulation.close()

    def now(self) -> float:
        """Time since the twin's start [s]."""
        return self._clock() - self.start

    def angle_deg(self, output: int, t: float | None = None) -> float:
        """Angle of a motor [deg] now, or at host time `t` [s] of the last half second."""
        if output not in self._outputs:
            return 0.0
        with self._lock:
            now = self._catch_up()
            row = self.simulation.motion.row_at(now if t is None else t - self.start)
        return self._sign * math.degrees(float(row[WHEELS + self._outputs.index(output)]))

    def turn(self, output: int, percent: float) -> None:
        """Regulate a motor to a speed in percent; 0 brakes."""
        if output not in self._outputs:
            return
        with self._lock:
            self._catch_up()
            self._goals[self._outputs.index(output)] = self._sign * percent * PERCENT_RATE
            self.simulation.turn_wheels((self._goals[0], self._goals[1]))

    def release(self, output: int) -> None:
        """A motor that floats brakes here too: the twin's motors know no other rest."""
        self.turn(output, 0)

    def motors(self) -> tuple[int, ...]:
        """Outputs with a motor."""
        return self._outputs

    def sensors(self) -> dict[int, int]:
        """The gyro."""
        gyro = self._wiring.gyro
        return {} if gyro is None or self._twin.spec.imu is None else {gyro: ev3_direct.GYRO}

    def sense(self, number: int, mode: int) -> tuple[float, ...]:
        """The gyro's angle and rate: whole degrees, clockwise."""
        del number
        with self._lock:
            self._catch_up()
            angle_deg, rate_deg = float(-round(self._angle_deg)), float(-round(self._rate_deg))
        return {ev3_direct.GYRO_ANGLE: (angle_deg,), ev3_direct.GYRO_RATE: (rate_deg,), 3: (angle_deg, rate_deg)}.get(mode, ())

    def battery(self) -> tuple[float, float]:
        """Volts and amperes."""
        volts = self.simulation.battery_volts
        return (VOLTS if volts is None else volts), AMPERES

    def next_turn(self) -> Turn | None:
        """The next turn of the lidar that nobody has taken."""
        self._glance()
        return self._turns.popleft() if self._turns else None

    def next_image(self) -> RgbdImage | None:
        """The next image of the camera that nobody has taken."""
        self._glance()
        return self._images.popleft() if self._images else None

    def pose(self, t: float) -> SE2:
        """The truth: `T_world_base` at host time `t` [s]."""
        with self._lock:
            self._catch_up()
            return self.simulation.motion.pose_at(t - self.start)

    def new_truth(self) -> Trajectory:
        """The truth since the last call, at times of the host."""
        with self._lock:
            track = self.simulation.motion.track[self._told :: EVERY].copy()
            stamps = self.start + STEP * (self._told + EVERY * np.arange(len(track), dtype=np.float64))
            self._told += EVERY * len(track)
        return Trajectory(stamps, track)

    def _glance(self) -> None:
        """Catch up unless somebody does so already: a lidar answers questions while the camera's image is drawn."""
        if self._lock.acquire(blocking=False):
            try:
                self._catch_up()
            finally:
                self._lock.release()

    def _follow(self) -> None:
        while not self._ended.wait(BEAT):
            with self._lock:
                self._catch_up()

    def _catch_up(self) -> float:
        """Bring the twin to the present; returns its time [s]."""
        behind = self._clock() - self.start - self.simulation.now
        if behind <= 0.0:
            return self.simulation.now
        if behind > LATE and not self._late:
            _log.warning("the twin is %.1f s behind: this machine is too busy for real time; close other programs", behind)
        self._late = behind > LATE
        now = self.simulation.now + min(behind, AT_ONCE)
        self.simulation.advance(now, self._queues)
        for reading in self._inbox["imu"].take():
            self._feel(reading)
        self._turns.extend(map(_turn, self._inbox["scans"].take()))
        self._images.extend(self._inbox["images"].take())
        return now

    def _feel(self, reading: Imu) -> None:
        self._rate_deg = math.degrees(reading.yaw_rate)
        imu = self._twin.spec.imu
        self._angle_deg += self._rate_deg * (imu.period if imu is not None else 0.0)


def _queues() -> dict[str, EventQueue[Any]]:
    return {name: EventQueue() for name in ("odometry", "imu", "scans", "images", "commands")}


def _rehearse(simulation: Simulation) -> None:
    """Drive an episode of its own through standing, turning wheels and a whole scan."""
    queues = _queues()
    try:
        for rates in ((0.0, 0.0), (2.0, 1.0), (0.0, 0.0)):
            simulation.turn_wheels(rates)
            simulation.advance(simulation.now + REHEARSAL, queues)
    finally:
        simulation.close()


def _turn(scan: LaserScan) -> Turn:
    return Turn(scan.stamp - UG01.first * scan.time_increment, scip_sweep.to_millimetres(scan.ranges))
