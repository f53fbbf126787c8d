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
from hardware.protocols import scip_sweep
from hardware.queues import EventQueue
from hardware.spec import LidarSpec
from scripts.bench.wire.trial import Trial
from slam.messages import LaserScan


class LidarTrial(Trial):
    """Open from the first scan on."""

    def __init__(self) -> None:
        super().__init__("lidar, serial")
        self._told: dict[bytes, tuple[float, float]] = {}
        self.stamp_errors: list[float] = []
        """Of the scans so far [s]."""

    def _connect(self, held: ExitStack) -> None:
        folder = held.enter_context(TemporaryDirectory())
        self.port = held.enter_context(Port(UrgLidar(self._turn, self.twin.now), PtyChannel(Path(folder) / "lidar")))
        scans = EventQueue[LaserScan]()
        self._inbox = scans.subscribe()
        self.driver = HokuyoDriver(self.port.address, LidarSpec(), scans)
        held.callback(self.driver.close)
        self.driver.open()

    def look(self) -> None:
        """Judge what has come: a scan that is no turn of the lidar's is wrong."""
        for scan in self._inbox.take():
            told = self._told.get(scip_sweep.to_millimetres(scan.ranges).tobytes())
            if told is None:
                self.wrong += 1
                continue
            true_stamp, self.newest = told
            self.stamp_errors.append(scan.stamp - UG01.first * scan.time_increment - true_stamp)

    def _turn(self) -> Turn | None:
        turn = self.twin.next_turn()
        if turn is not None:
            self._told[turn.ranges_mm.tobytes()] = self.twin.start + turn.stamp, time.monotonic()
        return turn
