"""The verb `twin worlds`: what worlds there are, what one looks like, and one as a file to edit.

`twin worlds` lists them, `twin worlds preview NAME --out x.png` draws a plan, `twin worlds export NAME --out x.toml`
writes the world as TOML, the start of a world of your own: `twin run --world x.toml`. NAME is what `--world` takes
everywhere: a name, a name with options (`aruco_room:spacing=0.3,furniture=false`) or a path to a .toml file.
"""

from __future__ import annotations

import io
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console
from rich.table import Table
from tyro.conf import Positional, subcommand

from scripts.preview import draw_world
from worlds.errors import WorldFileError
from worlds.loader import dump_world, load_world, world_names

HELP = "list the worlds, draw one as a plan, write one as a TOML file"


@dataclass(frozen=True)
class ListWorlds:
    """List all worlds: size, markers, description."""

    def run(self) -> None:
        """Print the table."""
        table = Table("world", "size [m]", "markers", "description", title="Worlds", title_justify="left")
        for name in world_names():
            world = load_world(name)
            x0, y0, x1, y1 = world.bounds
            table.add_row(name, f"{x1 - x0:.2f} x {y1 - y0:.2f}", str(len(world.markers)), world.description)
        Console().print(table)


@dataclass(frozen=True)
class PreviewWorld:
    """Draw the plan of a world: walls, furniture, markers with their ids, start and tour."""

    name: Positional[str]
    """NAME, NAME:option=value,option=value or a path to a .toml file."""
    out: Path
    """Picture to write; its ending says the format: .png, .svg or .pdf."""

    def run(self) -> None:
        """Write the picture."""
        kind = self.out.suffix.lower().lstrip(".")
        if kind not in ("png", "svg", "pdf"):
            raise WorldFileError(str(self.out), None, "must end in .png, .svg or .pdf")
        picture = io.BytesIO()
        draw_world(load_world(self.name)).savefig(picture, format=kind)
        _write(self.out, picture.getvalue())


@dataclass(frozen=True)
class ExportWorld:
    """Write a world as a TOML file, which loads as the same world."""

    name: Positional[str]
    """NAME, NAME:option=value,option=value or a path to a .toml file."""
    out: Path
    """File to write; must end in .toml to be loaded again."""

    def run(self) -> None:
        """Write the file."""
        if self.out.suffix != ".toml":
            raise WorldFileError(str(self.out), None, "must end in .toml")
        _write(self.out, dump_world(load_world(self.name)).encode())


Command = (
    Annotated[ListWorlds, subcommand("list")]
    | Annotated[PreviewWorld, subcommand("preview")]
    | Annotated[ExportWorld, subcommand("export")]
)


def main(argv: list[str]) -> int:
    """Run `twin worlds ARGV`; returns the exit code.

    Raises:
        WorldError: no such world, a wrong one, or a file that cannot be written.
    """
    command = tyro.cli(Command, args=argv or ["list"], prog="twin worlds", description=__doc__)  # type: ignore[arg-type]
    command.run()
    return 0


def _write(path: Path, content: bytes) -> None:
    """Write a file whole or not at all."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_bytes(content)
        os.replace(part, path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise WorldFileError(str(path), None, f"cannot be written: {error.strerror}") from error
    print(f"wrote {path}")
