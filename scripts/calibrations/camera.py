"""`twin calibrate camera`: K and distortion from photographs of a board, a film of it, a recording or a live robot."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg

from scripts.calibrations.coverage import Views, write_coverage_png
from scripts.calibrations.sources import FILMS, Picture, film, photographs, seen_by_robot, standstills
from scripts.errors import UsageError
from scripts.options import OptionalFile, parse
from scripts.runs.body import TWINS
from scripts.runs.files import OutputError
from scripts.runs.options import RunOptions
from slam.landmarks.boards import Board, BoardFinder, BoardView
from slam.landmarks.camera_calibration import Calibration, CalibrationError, Distortion, ViewChoice, calibrate
from slam.landmarks.camera_info_file import write_camera_info

ROUND = 50.0
"""How long a robot takes to turn once in steps [s]."""
OF_THE_WORLD = (0, 17, 34, 51, 68, 85)
"""First ids of the boards in the world `calibration`."""
LOOKS = 8
"""Pictures without the board that are looked at in a mirror."""


@dataclass(frozen=True)
class CameraOptions:
    """Measure K and the distortion of a camera and write them as ROS's CameraInfo YAML, with a picture of what the views cover.

    $ twin calibrate camera --images photos --square 0.04 --marker 0.02     photographs of a ChArUco board
    $ twin calibrate camera --images walk.mp4 --kind chessboard --squares 9 6     a film; pictures in which the board stands still count
    $ twin calibrate camera --robot sim                                     the simulated robot turns among boards
    $ twin calibrate camera --robot replay:runs/boards                      a recording with images

    `twin print board` prints one. Show it tilted to several sides, near and far, also at the picture's edges; ten views are good.
    `twin run --camera-info FILE` takes the result.
    """

    images: Annotated[tuple[Path, ...], arg(metavar="PATH...")] = ()
    """Photographs, folders of them, or one film."""
    robot: Annotated[str, arg(metavar="BODY", help_behavior_hint="(default: none, --images)")] = ""
    """Whose camera it is, as in `twin run`: sim, kinematic, ev3, replay:PATH."""
    world: Annotated[str, arg(metavar="NAME")] = "calibration"
    """World of a simulated robot; this one has boards."""
    policy: Annotated[str, arg(metavar="NAME", help_behavior_hint="(default: spin; none on a recording)")] = ""
    """What drives the robot."""
    duration: Annotated[float, arg(metavar="S")] = ROUND
    """How long a robot is watched [s]."""
    seed: Annotated[int, arg(metavar="N")] = 0
    """Of a simulation."""
    realism: Annotated[str, arg(metavar="NAME")] = "datasheet"
    """Of a simulation."""
    ev3: Annotated[str, arg(metavar="WHERE")] = "usb"
    """Where the real robot's brick is, as in `twin run`."""
    lidar: Annotated[str, arg(metavar="WHERE")] = "/dev/ttyACM0"
    """Where its lidar is, as in `twin run`."""
    camera: Annotated[str, arg(metavar="WHERE")] = "usb"
    """Where its camera is, as in `twin run`."""
    spec: OptionalFile = None
    """TOML file that describes the robot, as in `twin run`."""
    kind: Literal["charuco", "chessboard"] = "charuco"
    """What the board is: a ChArUco board may be seen in part, a chessboard must be seen whole."""
    squares: Annotated[tuple[int, int], arg(metavar="ACROSS DOWN")] = (Board().columns, Board().rows)
    """Squares of the board."""
    square: Annotated[float, arg(metavar="M")] = Board().square
    """Side of a square [m]."""
    marker: Annotated[float, arg(metavar="M")] = Board().marker
    """Side of a marker's black square [m]."""
    dictionary: Annotated[str, arg(metavar="NAME")] = Board().dictionary
    """Of the markers: OpenCV's name, or a file."""
    first: Annotated[tuple[int, ...], arg(metavar="ID...", help_behavior_hint="(default: 0; those of the world `calibration`)")] = ()
    """Id of the board's first marker; several: there are as many boards, alike but for their ids."""
    distortion: Distortion = "full"
    """`full` finds k1 k2 p1 p2 k3, `radial` k1 k2, `none` takes the lens for one without."""
    name: Annotated[str, arg(metavar="NAME")] = "camera"
    """The camera's name, in the file."""
    out: Annotated[Path, arg(metavar="FOLDER")] = Path("runs/calibration")
    """Where camera.yaml and coverage.png go."""

    def boards(self) -> list[Board]:
        """The boards.

        Raises:
            ParameterError: they cannot be.
        """
        firsts = self.first or (OF_THE_WORLD if self.robot in TWINS and self.world == "calibration" else (0,))
        return [Board(self.kind, *self.squares, self.square, self.marker, self.dictionary, first) for first in firsts]

    def pictures(self) -> tuple[Iterator[Picture], bool]:
        """The pictures, and whether they are a film.

        Raises:
            UsageError: there is no source, or more than one.
        """
        if bool(self.images) == bool(self.robot):
            raise UsageError("give either --images with photographs, a folder or a film, or --robot")
        if self.robot:
            return standstills(seen_by_robot(self._robot_options(), self.duration)), True
        if self.images[0].suffix.lower() in FILMS:
            return standstills(film(self.images[0])), True
        return photographs(self.images), False

    def _robot_options(self) -> RunOptions:
        policy = self.policy or ("none" if ":" in self.robot else "spin")
        shared = RunOptions(robot=self.robot, policy=policy, spec=self.spec)
        if self.robot in TWINS:
            return replace(shared, world=self.world, seed=self.seed, realism=self.realism, camera="raster")
        return replace(shared, ev3=self.ev3, lidar=self.lidar, camera=self.camera) if self.robot == "ev3" else shared


def main(argv: list[str]) -> int:
    """Look, calibrate, write, tell; returns the exit code.

    Raises:
        UsageError, SlamError, HardwareError, SimError, WorldError, OutputError: with one line that says what to do.
    """
    options = parse(CameraOptions, argv, "calibrate camera")
    boards = options.boards()
    views = gather(boards, *options.pictures())
    found = calibrate(boards[0], views.chosen, views.size, options.distortion)
    try:
        options.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(options.out, error) from error
    lines = _told(found, views)
    write_coverage_png(options.out / "coverage.png", f"{options.name}: {boards[0]}", found, views)
    write_camera_info(options.out / "camera.yaml", found.camera, options.name, "\n".join(lines))
    print("\n".join([*lines, f"{options.out / 'camera.yaml'}, {options.out / 'coverage.png'}"]))
    return 0


def gather(boards: Sequence[Board], pictures: Iterator[Picture], filmed: bool) -> Views:
    """Views of boards, alike but for their ids, that differ from each other, all of one size.

    Raises:
        UsageError: there is no picture, or sizes differ.
        CalibrationError: no picture shows the board, or all are mirrored.
    """
    first = next(pictures, None)
    if first is None:
        raise UsageError("there is no picture: the camera is silent, or there is none")
    size = first.image.shape[1], first.image.shape[0]
    finders, names, without, looked = [BoardFinder(board) for board in boards], list[str](), list[Picture](), 0
    choices, chosen = [ViewChoice(board, size, filmed) for board in boards], list[BoardView]()
    for picture in itertools.chain([first], pictures):
        looked += 1
        if picture.image.shape[1::-1] != size:
            width, height = picture.image.shape[1::-1]
            raise UsageError(f"{picture.name} is {width} x {height}, {first.name} {size[0]} x {size[1]}: K belongs to one resolution")
        markers = finders[0].markers(picture.image)
        views = [(choice, view) for finder, choice in zip(finders, choices, strict=True) if (view := finder.find(picture.image, markers))]
        without += [] if views or len(without) == LOOKS else [picture]
        kept = [view for choice, view in views if choice.add(view)]
        chosen += kept
        names += [picture.name] * len(kept)
    if not chosen:
        if any(finder.mirrored(picture.image) for picture in without for finder in finders):
            raise CalibrationError("the pictures are mirrored: take them as the camera delivers them")
        raise CalibrationError(f"no {boards[0]} in any of {looked} pictures; do kind, squares, dictionary and first id fit the print?")
    return Views(tuple(chosen), tuple(names), looked, size)


def _told(found: Calibration, views: Views) -> list[str]:
    K, (fx, fy, cx, cy) = found.camera.K, found.deviations.tolist()
    numbers = " ".join(f"{value:.5g}" for value in found.camera.D.tolist())
    left_out = [views.names[k] for k in range(len(views.names)) if k not in found.used]
    covered = 100.0 * views.coverage(found.used)
    return [
        f"{len(found.used)} views of {views.looked} pictures, RMS {found.rms:.3f} px, they cover {covered:.0f} % of the picture",
        f"fx {K[0, 0]:.2f} +- {fx:.2f}, fy {K[1, 1]:.2f} +- {fy:.2f}, cx {K[0, 2]:.2f} +- {cx:.2f}, cy {K[1, 2]:.2f} +- {cy:.2f} px",
        f"k1 k2 p1 p2 k3: {numbers}",
        *([f"left out, for they fit badly: {', '.join(left_out)}"] if left_out else []),
    ]
