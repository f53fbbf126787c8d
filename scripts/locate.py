"""The verb `twin locate`: where markers and boards are in photographs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from tyro.conf import Positional, arg

from scripts.calibrations.sources import Picture, photographs
from scripts.errors import UsageError
from scripts.locating.output import rows_of, write_axes_png, write_poses
from scripts.locating.targets import Found, LoneMarkers, MarkerSet, SquaresBoard, Target
from scripts.options import OptionalFile, parse
from scripts.runs.files import OutputError
from slam.landmarks.board_location import grid_board
from slam.landmarks.boards import Board
from slam.landmarks.camera_info_file import read_camera_info
from slam.landmarks.marker_family import MarkerFamily
from slam.landmarks.marker_map_file import read_marker_map
from slam.messages import CameraInfo

HELP = "find the poses of markers and boards in photographs, or the camera's in a marker map"


@dataclass(frozen=True)
class LocateOptions:
    """Write the poses of what photographs show to poses.csv, and each picture with the axes drawn: x red, y green, z blue.

    $ twin locate photo.jpg --camera-info camera.yaml --marker 0.05 --dictionary DICT_6X6_250     each marker
    $ twin locate photos --camera-info camera.yaml --board charuco --squares 5 7 --square 0.04 --marker 0.02
    $ twin locate photos --camera-info camera.yaml --board grid --squares 5 7 --marker 0.04 --gap 0.01
    $ twin locate photos --camera-info camera.yaml --marker-map markers.yaml     the camera in a map

    Frames: the camera's z looks ahead, x right, y down. A marker's origin is its middle, x right, y up, z out of the print. A board's is
    its top left corner, x right, y down, z into the print, as in OpenCV.
    """

    images: Annotated[Positional[tuple[Path, ...]], arg(metavar="IMAGE...", help_behavior_hint="")]
    """Photographs, or folders of them."""
    camera_info: Annotated[Path, arg(metavar="FILE")]
    """K and distortion: the YAML of `twin calibrate camera`, of ROS or of OpenCV."""
    marker_map: OptionalFile = None
    """Marker map, ours or ArUco's; it brings dictionary and sizes."""
    board: Literal["none", "charuco", "chessboard", "grid"] = "none"
    """What board there is; `grid` is one of markers in rows."""
    squares: Annotated[tuple[int, int], arg(metavar="ACROSS DOWN")] = (Board().columns, Board().rows)
    """Squares of the board, of a grid its markers."""
    square: Annotated[float, arg(metavar="M")] = Board().square
    """Side of a board's square [m]."""
    gap: Annotated[float, arg(metavar="M")] = 0.01
    """Between a grid's markers [m]."""
    marker: Annotated[float | None, arg(metavar="M", help_behavior_hint="")] = None
    """Side of a marker's black square [m]."""
    dictionary: Annotated[str, arg(metavar="NAME")] = Board().dictionary
    """Of the markers: OpenCV's name, or a file."""
    first: Annotated[int, arg(metavar="ID")] = 0
    """Id of a board's first marker, top left."""
    out: Annotated[Path, arg(metavar="FOLDER")] = Path("runs/located")
    """Where poses.csv and the pictures go."""

    def target(self) -> Target:
        """What to look for.

        Raises:
            UsageError: its size is missing, or there are two.
            SlamError: it cannot be.
        """
        if self.marker_map is not None:
            if self.board != "none":
                raise UsageError("--marker-map and --board name two things to look for; give one")
            markers = read_marker_map(self.marker_map)
            if not markers.markers:
                raise UsageError(f"--marker-map {self.marker_map}: there is no marker in it")
            return MarkerSet("map", markers)
        if self.marker is None and self.board != "chessboard":
            raise UsageError("give --marker, the side of a marker's black square [m]: without it nothing tells how far it is")
        side = self.marker or Board().marker
        if self.board == "none":
            return LoneMarkers(MarkerFamily(self.dictionary, side))
        if self.board == "grid":
            return MarkerSet("board", grid_board(*self.squares, side, self.gap, self.dictionary, self.first))
        return SquaresBoard(Board(self.board, *self.squares, self.square, side, self.dictionary, self.first))


def main(argv: list[str]) -> int:
    """Look, write, tell; returns the exit code.

    Raises:
        UsageError, SlamError, OutputError: with one line that says what to do.
    """
    options = parse(LocateOptions, argv, "locate")
    target, pictures = options.target(), list(photographs(options.images))
    if not pictures:
        raise UsageError("name a photograph, or a folder of them")
    camera = read_camera_info(options.camera_info, pictures[0].image.shape[1::-1])
    try:
        options.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(options.out, error) from error
    rows: list[str] = []
    for number, picture in enumerate(pictures):
        found, reason = target.find(picture.image, camera)
        name = _name(number, [p.name for p in pictures])
        write_axes_png(options.out / name, picture, camera, found, target.size)
        rows += [row for thing in found for row in rows_of(picture.name, thing, camera, isinstance(target, MarkerSet))]
        _tell(picture, camera, found, reason)
    if not rows:
        raise UsageError(f"nothing found in any of {len(pictures)} pictures; do dictionary, ids and board fit the print?")
    write_poses(options.out / "poses.csv", rows)
    print(f"{options.out / 'poses.csv'}, {len(pictures)} pictures beside it")
    return 0


def _name(number: int, names: list[str]) -> str:
    """The drawn picture's name; pictures of one name in several folders get numbers."""
    stem = Path(names[number]).stem
    alike = [Path(name).stem for name in names].count(stem) > 1
    return f"{stem}_{number}_axes.png" if alike else f"{stem}_axes.png"


def _tell(picture: Picture, camera: CameraInfo, found: list[Found], reason: str) -> None:
    if not found:
        print(f"{picture.name}: {reason}")
    for thing in found:
        x, y, z = thing.T_camera_target.t.tolist()
        roll, pitch, yaw = np.degrees(thing.T_camera_target.rpy()).tolist()
        doubt = "; its second pose fits nearly as well" if thing.ratio < 3.0 else ""
        print(
            f"{picture.name}: {thing.name} at {x:.4f} {y:.4f} {z:.4f} m +- {1e3 * thing.deviation:.1f} mm, roll pitch yaw "
            f"{roll:.2f} {pitch:.2f} {yaw:.2f} deg, {thing.used} of {len(thing.points)} corners, RMS {thing.rms(camera):.2f} px{doubt}"
        )
