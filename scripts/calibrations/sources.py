"""Where pictures come from: photographs, folders of them, films, and robots."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from hardware.hal import Recorded
from scripts.errors import UsageError
from scripts.runs.body import make_robot, policy_name, route
from scripts.runs.loop import PERIOD
from scripts.runs.options import RunOptions
from slam.messages import Estimate
from slam.navigation.policies import make_policy
from slam.pipelines import PIPELINES
from slam.se2 import SE2

PHOTOGRAPHS = (".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff", ".webp", ".pgm", ".ppm")
BLOCK, ALIKE = 8, 1.0
"""Side of the blocks [px] by whose mean grey levels pictures are compared, and below which difference they show the same."""
FILMS = (".mp4", ".avi", ".mkv", ".mov", ".webm", ".mjpeg")


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """An image and where it is from."""

    name: str
    image: NDArray[np.uint8]
    """(H, W, 3) red, green, blue."""


def photographs(paths: Sequence[Path]) -> Iterator[Picture]:
    """Those of files and folders, by name.

    Raises:
        UsageError: there are none, or one cannot be read.
    """
    files = [file for path in paths for file in _files(path)]
    for file in files:
        image = cv2.imread(str(file), cv2.IMREAD_COLOR)
        if image is None:
            raise UsageError(f"{file}: not a picture that can be read")
        yield Picture(file.name, np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), np.uint8))


def standstills(pictures: Iterator[Picture]) -> Iterator[Picture]:
    """Of a film, two pictures that follow on each other each time it comes to stand: to look for a board takes longer than a picture."""
    before: Picture | None = None
    taken, last = np.empty((0, 0), np.uint8), np.empty((0, 0), np.uint8)
    for picture in pictures:
        small = _small(picture.image)
        if before is not None and _alike(small, last) and not _alike(small, taken):
            taken = small
            yield before
            yield picture
        before, last = picture, small


def _small(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    return np.asarray(cv2.resize(grey, None, fx=1.0 / BLOCK, fy=1.0 / BLOCK, interpolation=cv2.INTER_AREA), np.uint8)


def _alike(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> bool:
    return a.shape == b.shape and float(np.mean(cv2.absdiff(a, b))) < ALIKE


def film(path: Path) -> Iterator[Picture]:
    """The pictures of a film.

    Raises:
        UsageError: it cannot be read.
    """
    reader = cv2.VideoCapture(str(path))
    number = 0
    try:
        while True:
            shown, image = reader.read()
            if not shown:
                break
            number += 1
            yield Picture(f"{path.name} picture {number}", np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), np.uint8))
    finally:
        reader.release()
    if number == 0:
        raise UsageError(f"{path}: not a film that can be read")


def seen_by_robot(options: RunOptions, duration: float) -> Iterator[Picture]:
    """The colour images of a robot's camera, or of a recording, while the policy turns the robot; wheels and gyro tell it where it is.

    Raises:
        UsageError, HardwareError, SimError, WorldError: with one line that says what to do.
    """
    robot, pipeline = make_robot(options), PIPELINES["odometry"]().build()
    recorded = isinstance(robot, Recorded)
    policy = make_policy(policy_name(options, robot), route(options, SE2()))
    with robot:
        clock, end = robot.clock, math.inf if recorded else robot.clock.now() + duration
        if robot.spec.camera is None and not recorded:
            raise UsageError(f"--robot {options.robot}: this robot has no camera")
        while clock.now() < end and clock.sleep_until(clock.now() + PERIOD):
            frame = robot.read()
            yield from (Picture(f"the image at {image.stamp:.2f} s", image.colour) for image in frame.images)
            estimate: Estimate = pipeline.update(frame)
            command = policy(frame, estimate, pipeline.snapshot())
            if command is not None:
                robot.drive(command)


def _files(path: Path) -> list[Path]:
    if path.is_dir():
        found = sorted(file for file in path.iterdir() if file.suffix.lower() in PHOTOGRAPHS)
        if not found:
            raise UsageError(f"{path}: no pictures in this folder ({', '.join(PHOTOGRAPHS)})")
        return found
    if not path.is_file():
        raise UsageError(f"{path}: no such file")
    return [path]
