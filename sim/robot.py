"""The twin as a `Robot`."""

from __future__ import annotations

import math
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Any, Literal, Self

import numpy as np

from hardware.errors import NotOpenError
from hardware.hal import WATCHDOG, Command, Health
from hardware.queues import EventQueue
from hardware.spec import DriveSpec, RobotSpec
from sim.devices import Devices
from sim.drive import Motors
from sim.motion import STEP
from sim.physics import Physics
from sim.realism import REALISMS
from slam.messages import LaserScan, SensorFrame, Twist
from worlds.loader import load_world
from worlds.world import World
