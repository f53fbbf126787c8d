"""The verb `twin worlds`: what worlds there are, what one looks like, and one as a file to edit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from PIL import Image
from rich.console import Console
from rich.table import Table
from tyro.conf import Positional, arg, subcommand

from scripts.camera_view import camera_view
from scripts.options import parse
from scripts.preview import draw_world
from scripts.runs.files import write_text, write_via
from scripts.splits import CheckSplits
from worlds.errors import WorldFileError
from worlds.loader import load_world, world_names
from worlds.toml_file import dump_world

HELP = "list the worlds, draw one as a plan, write one as a TOML file"

ABOUT = """List the worlds of the simulation, draw one as a plan, or write one as a TOML file: the start of a world of your own.

$ twin worlds                                             what there is
$ twin worlds preview aruco_room --out room.png           a plan with markers and route
$ twin worlds preview office:people=5,moved=0.3,doors=open,seed=3 --out busy.png
$ twin worlds preview office:people=4 --camera --out view.png    what the robot's camera sees
$ twin worlds export aruco_room --out mine.toml           a file to edit
$ twin worlds splits                                      check the frozen maps for exploring
$ twin run --world mine.toml                              and to drive in

NAME is what --world takes everywhere: a name or a .toml file, either with options (aruco_room:spacing=0.3,people=2), or a map of
ROS as map:file=FILE.yaml. All worlds take people=COUNT, moved=SHARE, doors=open|closed|ajar|swinging and seed=NUMBER.
"""

WorldName = Annotated[Positional[str], arg(metavar="NAME")]


@dataclass(frozen=True)
class ListWorlds:
    """List all worlds: size, markers, description."""

    def run(self) -> None:
        """Print the table."""
        table = Table("world", r"outer size \[m]", "markers", "description", title="Worlds", title_justify="left")
        for name in world_names():
            world = load_world(name)
            x0, y0, x1, y1 = world.bounds
            table.add_row(name, f"{x1 - x0:.2f} x {y1 - y0:.2f}", str(len(world.markers)), world.description)
        table.add_row("map:file=FILE.yaml", "", "", "any map of map_server")
        Console().print(table)


@dataclass(frozen=True)
class PreviewWorld:
    """Draw the plan of a world: walls, furniture, markers with their ids, start and tour; or what the robot's camera sees of it."""

    name: WorldName
    """NAME or a path to a .toml file, either with :option=value,option=value after it."""
    out: Path
    """Picture to write; its ending says the format: .png, .svg or .pdf; of the camera's view .png or .jpg."""
    camera: bool = False
    """Show what the robot's camera sees."""
    view: Annotated[tuple[float, float, float] | None, arg(metavar="X Y YAW", help_behavior_hint="(default: where it sees most)")] = None
    """Where the robot stands for it: x, y [m], yaw [deg]."""
    time: Annotated[float, arg(metavar="S")] = 4.0
    """When that is: people walk and doors swing by the clock [s], as long as no robot is in their way."""

    def run(self) -> None:
        """Write the picture."""
        endings = (".png", ".jpg") if self.camera else (".png", ".svg", ".pdf")
        if self.out.suffix not in endings:
            raise WorldFileError(str(self.out), None, f"must end in {', '.join(endings)}")
        world = load_world(self.name)
        if self.camera:
            picture = camera_view(world, None if self.view is None else (*self.view[:2], math.radians(self.view[2])), self.time)
            write_via(self.out, Image.fromarray(picture).save)
        else:
            write_via(self.out, draw_world(world).savefig)
        print(f"wrote {self.out}")


@dataclass(frozen=True)
class ExportWorld:
    """Write a world as a TOML file, which loads as the same world."""

    name: WorldName
    """NAME or a path to a .toml file, either with :option=value,option=value after it."""
    out: Path
    """File to write; must end in .toml to be loaded again."""

    def run(self) -> None:
        """Write the file."""
        if self.out.suffix != ".toml":
            raise WorldFileError(str(self.out), None, "must end in .toml")
        write_text(self.out, dump_world(load_world(self.name)))
        print(f"wrote {self.out}")


Command = (
    Annotated[ListWorlds, subcommand("list")]
    | Annotated[PreviewWorld, subcommand("preview")]
    | Annotated[ExportWorld, subcommand("export")]
    | Annotated[CheckSplits, subcommand("splits")]
)


def main(argv: list[str]) -> int:
    """Run `twin worlds ARGV`; returns the exit code.

    Raises:
        WorldError: no such world, or a wrong one.
        OutputError: the file cannot be written.
    """
    parse(Command, argv or ["list"], "worlds", ABOUT).run()
    return 0
