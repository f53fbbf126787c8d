"""The verb `twin worlds`: what worlds there are, what one looks like, and one as a file to edit."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from rich.console import Console
from rich.table import Table
from tyro.conf import Positional, arg, subcommand

from scripts.options import parse
from scripts.preview import draw_world
from scripts.runs.files import write_text, write_via
from worlds.errors import WorldFileError
from worlds.loader import load_world, world_names
from worlds.toml_file import dump_world

HELP = "list the worlds, draw one as a plan, write one as a TOML file"

ABOUT = """List the worlds of the simulation, draw one as a plan, or write one as a TOML file: the start of a world of your own.

$ twin worlds                                             what there is
$ twin worlds preview aruco_room --out room.png           a plan with markers and route
$ twin worlds export aruco_room --out mine.toml           a file to edit
$ twin run --world mine.toml                              and to drive in

NAME is what --world takes everywhere: a name, a name with options (aruco_room:spacing=0.3,furniture=false) or a .toml file.
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
        Console().print(table)


@dataclass(frozen=True)
class PreviewWorld:
    """Draw the plan of a world: walls, furniture, markers with their ids, start and tour."""

    name: WorldName
    """NAME, NAME:option=value,option=value or a path to a .toml file."""
    out: Path
    """Picture to write; its ending says the format: .png, .svg or .pdf."""

    def run(self) -> None:
        """Write the picture."""
        if self.out.suffix not in (".png", ".svg", ".pdf"):
            raise WorldFileError(str(self.out), None, "must end in .png, .svg or .pdf")
        write_via(self.out, draw_world(load_world(self.name)).savefig)
        print(f"wrote {self.out}")


@dataclass(frozen=True)
class ExportWorld:
    """Write a world as a TOML file, which loads as the same world."""

    name: WorldName
    """NAME, NAME:option=value,option=value or a path to a .toml file."""
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
)


def main(argv: list[str]) -> int:
    """Run `twin worlds ARGV`; returns the exit code.

    Raises:
        WorldError: no such world, or a wrong one.
        OutputError: the file cannot be written.
    """
    parse(Command, argv or ["list"], "worlds", ABOUT).run()
    return 0
