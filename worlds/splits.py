"""The maps for exploring: generated families in frozen splits, named by seed and pinned by digests."""

from __future__ import annotations

import functools
import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import msgspec
import numpy as np

from worlds.errors import WorldError
from worlds.loader import load_world
from worlds.world import World

FAMILIES = ("burrow", "cave", "clutter", "flat", "forest", "maze", "warehouse", "wing")
DIFFICULTIES: dict[str, tuple[float, float]] = {"easy": (6.0, 8.0), "medium": (8.0, 12.0), "complex": (12.0, 17.0)}
"""name -> least and greatest side of a map [m]."""
SPLITS: dict[str, int] = {"train": 5000, "validation": 200, "test": 100}
"""name -> how many maps; of `test` so many for each difficulty, in the others families and difficulties take turns."""
DIGESTS = Path(__file__).parent / "splits.txt"
DIGITS = 8
"""Of a digest that are kept."""
MAZE_CELL = 0.9


class SplitError(WorldError):
    """A split, a family, a difficulty or an index that does not exist."""


@dataclass(frozen=True, slots=True)
class MapName:
    """One map of a split."""

    split: str
    difficulty: str
    index: int
    """From 0 on; in `test` within its difficulty."""

    def __post_init__(self) -> None:
        for value, what, known in ((self.split, "split", SPLITS), (self.difficulty, "difficulty", DIFFICULTIES)):
            if value not in known:
                raise SplitError(f"no {what} '{value}'; available: {', '.join(known)}")
        if not 0 <= self.index < SPLITS[self.split]:
            raise SplitError(f"no map {self.index} in '{self.split}'; it has 0 to {SPLITS[self.split] - 1}")

    @property
    def family(self) -> str:
        """Name of the generator."""
        return FAMILIES[self.index % len(FAMILIES)]

    @property
    def text(self) -> str:
        """What `load_world` takes."""
        key = (list(SPLITS).index(self.split), list(DIFFICULTIES).index(self.difficulty), self.index)
        random = np.random.default_rng(key)
        width, depth = random.uniform(*DIFFICULTIES[self.difficulty], 2).round(1).tolist()
        sides = f"columns={width / MAZE_CELL:.0f},rows={depth / MAZE_CELL:.0f}" if self.family == "maze" else f"width={width},depth={depth}"
        return f"{self.family}:{sides},seed={int(random.integers(1 << 31))},tour=false"


def map_names(split: str, difficulty: str = "", family: str = "") -> list[MapName]:
    """The maps of a split, of one difficulty and of one family or of all.

    Raises:
        SplitError: one of the names does not exist.
    """
    known = [(split, "split", SPLITS), (difficulty or "easy", "difficulty", DIFFICULTIES), (family or FAMILIES[0], "family", FAMILIES)]
    for value, what, names in known:
        if value not in names:
            raise SplitError(f"no {what} '{value}'; available: {', '.join(names)}")
    return [name for name in _all_of(split) if difficulty in ("", name.difficulty) and family in ("", name.family)]


@functools.cache
def _all_of(split: str) -> tuple[MapName, ...]:
    levels, count = list(DIFFICULTIES), SPLITS[split]
    if split == "test":
        return tuple(MapName(split, level, index) for level in levels for index in range(count))
    return tuple(MapName(split, levels[index // len(FAMILIES) % len(levels)], index) for index in range(count))


def digest(world: World) -> str:
    """What pins a world: of what it has, in the order of its fields, to the millimetre and the milliradian. What it has not, it may get."""
    return hashlib.sha256(repr(_rounded(msgspec.to_builtins(world))).encode()).hexdigest()[:DIGITS]


def _rounded(value: Any) -> object:  # noqa: ANN401 (what msgspec makes of a struct)
    if isinstance(value, float):
        return round(value, 3) + 0.0
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in cast("dict[str, Any]", value).items() if item not in ([], {}, None, "")}
    return [_rounded(item) for item in cast("list[Any]", value)] if isinstance(value, list | tuple) else value


@functools.cache
def pinned() -> dict[MapName, str]:
    """The digest of every map, as it was frozen.

    Raises:
        SplitError: the file is missing or spoilt.
    """
    try:
        lines = dict(line.split() for line in DIGESTS.read_text(encoding="ascii").splitlines())
        return {name: lines[split][DIGITS * i : DIGITS * (i + 1)] for split in SPLITS for i, name in enumerate(_all_of(split))}
    except (OSError, ValueError, KeyError) as error:
        raise SplitError(f"{DIGESTS.name} cannot be read ({error}); write it with `twin worlds freeze`") from error


def measured(name: MapName) -> str:
    """The digest of a map as it is generated now."""
    return digest(load_world(name.text))
