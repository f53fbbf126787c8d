"""What surfaces and prints look like, made from numbers: the same on every run."""

from __future__ import annotations

import math
from functools import cache
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from slam.landmarks import boards
from slam.se2 import FloatArray
from worlds.parts import Board

Cells = NDArray[np.uint8]
"""(h, w, 3) red, green, blue of the cells of a print."""

SIZE = 512
"""Texels along a side of a surface's texture, which repeats."""
TEXEL = 0.004
"""Side of a texel [m]."""
LEVELS = SIZE.bit_length() - 2
"""Of a texture's pyramid, each half the size of the one before."""
COLOURS = {
    "plain": (200, 196, 188),
    "planks": (164, 124, 84),
    "tiles": (176, 172, 160),
    "carpet": (96, 104, 120),
    "concrete": (150, 150, 148),
    "plaster": (218, 212, 198),
    "brick": (168, 96, 74),
    "rock": (120, 110, 100),
    "panels": (190, 170, 140),
    "grain": (170, 140, 110),
}
"""Name of a texture -> colour of the surface under it. What is `plain` has no texture, furniture has `grain`."""
MARGIN = 1
"""White modules round a marker."""


@cache
def surface_texture(name: str) -> FloatArray:
    """(SIZE, SIZE) brightness, 1 on average, of a texture of `COLOURS`; rows are up the wall or along the world's y."""
    rng = np.random.default_rng([ord(letter) for letter in name])
    grain = 1.0 + 0.03 * _noise(rng, 1.5) + 0.02 * _noise(rng, 12.0)
    match name:
        case "plain":
            shades = np.ones((SIZE, SIZE))
        case "planks":
            shades = grain * _boards(rng, 64, 256)
        case "panels":
            shades = grain * _boards(rng, 512, 128)
        case "tiles":
            shades = grain * _bricks(rng, (128, 128), 0)
        case "brick":
            shades = (grain + 0.1 * _noise(rng, 1.0)) * _bricks(rng, (32, 64), 32)
        case "carpet" | "rock":
            shades = 1.0 + 0.1 * _noise(rng, 1.0) + 0.06 * _noise(rng, 4.0) + 0.06 * _noise(rng, 24.0)
        case _:
            shades = grain + 0.02 * _noise(rng, 40.0)
    return shades / shades.mean()


@cache
def pyramid(name: str) -> NDArray[np.float32]:
    """All levels of a surface's texture, one after the other, each the mean of four texels of the one before."""
    levels = [surface_texture(name)]
    for _ in range(LEVELS - 1):
        fine = levels[-1]
        levels.append(fine.reshape(len(fine) // 2, 2, -1, 2).mean(axis=(1, 3)))
    return np.concatenate([level.ravel() for level in levels]).astype(np.float32)


@cache
def marker_print(dictionary: str, number: int) -> Cells:
    """A marker's modules with a white margin of one module all round: (modules + 2, modules + 2, 3)."""
    known = cv2.aruco.getPredefinedDictionary(cast(int, getattr(cv2.aruco, dictionary)))
    modules = cv2.aruco.generateImageMarker(known, number, known.markerSize + 2)
    return np.repeat(np.pad(np.asarray(modules, np.uint8), MARGIN, constant_values=255)[:, :, None], 3, axis=2)


@cache
def board_print(board: Board) -> Cells:
    """The cells of a ChArUco board, without a margin."""
    print_ = boards.Board("charuco", board.columns, board.rows, board.square, 0.75 * board.square, board.dictionary, board.first)
    return np.repeat(np.where(print_.cells()[0], 0, 255).astype(np.uint8)[:, :, None], 3, axis=2)


@cache
def poster_print(seed: int, width: int = 120, height: int = 160) -> Cells:
    """A picture of coloured discs, bars and lines on a bright ground: many corners, no two alike."""
    rng = np.random.default_rng([seed, 77])
    picture = np.full((height, width, 3), rng.integers(190, 250, 3), np.uint8)
    for _ in range(28):
        colour = [int(channel) for channel in rng.integers(10, 245, 3)]
        (x, y), (u, v) = rng.integers(0, (width, height)).tolist(), rng.integers(6, 40, 2).tolist()
        if rng.random() < 0.5:
            cv2.rectangle(picture, (x, y), (x + u, y + v), colour, -1)
        else:
            cv2.circle(picture, (x, y), u // 2 + 2, colour, -1)
    for row in range(12, height // 3, 9):
        cv2.line(picture, (10, row), (int(rng.integers(width // 2, width - 10)), row), (30, 30, 30), 2)
    cv2.rectangle(picture, (0, 0), (width - 1, height - 1), (250, 250, 250), 5)
    return picture


def _noise(rng: np.random.Generator, scale: float) -> FloatArray:
    """(SIZE, SIZE) noise that repeats, of deviation 1, smooth over `scale` texels."""
    frequency = np.fft.fftfreq(SIZE)
    damping = np.exp(-2.0 * (math.pi * scale) ** 2 * (frequency[:, None] ** 2 + frequency[None, : SIZE // 2 + 1] ** 2))
    noise = np.fft.irfft2(np.fft.rfft2(rng.standard_normal((SIZE, SIZE))) * damping, (SIZE, SIZE))
    return noise / noise.std()


def _boards(rng: np.random.Generator, length: int, width: int) -> FloatArray:
    """Boards of unequal brightness along the rows, with dark joints."""
    shades = np.ones((SIZE, SIZE))
    tall, wide = (length, width) if length < width else (SIZE, width)
    for top in range(0, SIZE, tall):
        shift = int(rng.integers(0, wide))
        for left in range(0, SIZE, wide):
            columns = (np.arange(left, left + wide) + shift) % SIZE
            shades[top : top + tall, columns] = rng.uniform(0.88, 1.08)
            shades[top : top + tall, columns[:1]] = 0.55
        if tall < SIZE:
            shades[top] = 0.55
    return shades


def _bricks(rng: np.random.Generator, size: tuple[int, int], shift: int) -> FloatArray:
    """Bricks of (height, width) in courses, with bright joints."""
    shades = np.full((SIZE, SIZE), 1.25)
    for course, top in enumerate(range(0, SIZE, size[0])):
        for left in range(0, SIZE, size[1]):
            columns = (np.arange(left + 2, left + size[1]) + course % 2 * shift) % SIZE
            shades[top + 2 : top + size[0], columns] = rng.uniform(0.85, 1.1)
    return shades
