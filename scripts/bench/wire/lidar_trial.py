"""A lidar driver on a wire to an emulator whose turns are known."""

from __future__ import annotations

import time
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

from hardware.drivers.hokuyo import HokuyoDriver
from hardware.emulators.channels import PtyChannel
from hardware.emulators.port import Port
from hardware.emulators.urg_lidar import UG01, Turn, UrgLidar
from hardware.openable import Openable
from hardware.protocols import scip_sweep
from hardware.queues import EventQueue
from hardware.spec import LidarSpec
from scripts.bench.wire.stage import WORLD
from sim.kinematic import Kinematic
from sim.wire import WiredTwin, on_the_wire
from slam.messages import LaserScan


class LidarTrial(Openable):
    """Open from the first scan on. See `faults.Trial`."""

    name = "lidar, serial"

    def __init__(self) -> None:
        self._held = ExitStack()
        self._told: dict[bytes, float] = {}
        self.stamp_errors: list[float] = []
        """Of the scans so far [s]."""
        self.wrong = 0
        self.newest = float("-inf")

    def open(self) -> None:
        """Connect."""
        with ExitStack() as held:
            folder = held.enter_context(TemporaryDirectory())
            self._twin = held.enter_context(WiredTwin(Kinematic(world=WORLD, realism=on_the_wire("datasheet")), time.monotonic))
            self.port = held.enter_context(Port(UrgLidar(self._turn, self._twin.now), PtyChannel(Path(folder) / "lidar")))
            scans = EventQueue[LaserScan]()
            self._inbox = scans.subscribe()
            self.driver = HokuyoDriver(self.port.address, LidarSpec(), scans)
            held.callback(self.driver.close)
            self.driver.open()
            self._held = held.pop_all()

    def close(self) -> None:
        """Let go of everything. May be called twice."""
        self._held.close()

    def look(self) -> None:
        """Judge what has come: a scan that is no turn of the lidar's is wrong."""
        for scan in self._inbox.take():
            true_stamp = self._told.get(scip_sweep.to_millimetres(scan.ranges).tobytes())
            if true_stamp is None:
                self.wrong += 1
                continue
            self.newest = scan.end
            self.stamp_errors.append(scan.stamp - UG01.first * scan.time_increment - true_stamp)

    def _turn(self) -> Turn | None:
        turn = self._twin.next_turn()
        if turn is not None:
            self._told[turn.ranges_mm.tobytes()] = self._twin.start + turn.stamp
        return turn
