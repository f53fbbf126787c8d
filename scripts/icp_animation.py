"""The steps of ICP as an animation, and its start and end as a picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from scripts.runs import palette
from scripts.runs.animation import COLOURS, FINE, Viewport
from scripts.runs.files import write_via
from scripts.scan_pairs import ScanPair
from slam.matching.icp import IcpStep
from slam.se2 import SE2, FloatArray

MOST_FRAMES = 60
FIRST_MS, FRAME_MS, LAST_MS = 1200, 160, 2500
WIDTH, HEIGHT, HEADER, CURVE = 760, 600, 62, 96
"""Largest picture of the scans, height of the text above and of the curve below it [px]."""
MARGIN = 0.3
"""Free paper around the scans [m]."""
LINK, GRID, AHEAD = "#f0a04b", "#eef0f3", "#d5d9df"
TARGET_DOT, SOURCE_DOT, ARROW = 2.4, 1.4, 7.0
"""Radius of a point of either scan, so that one shows behind the other, and of the arrows [px]."""


def write_icp_gif(path: Path, pair: ScanPair, steps: Sequence[IcpStep]) -> None:
    """Write the animation, at most 60 frames.

    Raises:
        OutputError: the file cannot be written.
    """
    viewport = _viewport(pair, steps)
    numbers = np.unique(np.linspace(0, len(steps) - 1, MOST_FRAMES).round().astype(int)).tolist()
    pictures = [_draw_step(pair, steps, number, viewport) for number in numbers]
    colours = pictures[0].quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    frames = [picture.quantize(palette=colours, dither=Image.Dither.NONE) for picture in pictures]
    durations = [FIRST_MS, *[FRAME_MS] * (len(frames) - 2), LAST_MS][-len(frames) :]
    write_via(path, lambda partial: frames[0].save(partial, save_all=True, append_images=frames[1:], duration=durations, loop=0))


def write_icp_png(path: Path, pair: ScanPair, steps: Sequence[IcpStep]) -> None:
    """Write the start and the end side by side.

    Raises:
        OutputError: the file cannot be written.
    """
    viewport = _viewport(pair, steps)
    start, end = (_draw_step(pair, steps, number, viewport) for number in (0, len(steps) - 1))
    picture = Image.new("RGB", (start.width + end.width, start.height), palette.PAGE)
    picture.paste(start, (0, 0))
    picture.paste(end, (start.width, 0))
    write_via(path, picture.save)


def _viewport(pair: ScanPair, steps: Sequence[IcpStep]) -> Viewport:
    """Room for the target and for the source wherever it goes."""
    poses = [step.T_target_source for step in (steps[0], steps[-1])]
    everything = np.concatenate([pair.target, np.zeros((1, 2)), *(pose.transform(pair.source) for pose in poses)])
    low, high = everything.min(axis=0) - MARGIN, everything.max(axis=0) + MARGIN
    scale = FINE * min(WIDTH / (high[0] - low[0]), HEIGHT / (high[1] - low[1]))
    width, height = WIDTH * FINE, math.ceil(scale * (high[1] - low[1]) / FINE) * FINE
    return Viewport(scale, 0.5 * (low[0] + high[0] - width / scale), float(high[1]), (width, height))


def _draw_step(pair: ScanPair, steps: Sequence[IcpStep], number: int, viewport: Viewport) -> Image.Image:
    step = steps[number]
    fine = Image.new("RGB", viewport.size, palette.PAGE)
    draw = ImageDraw.Draw(fine)
    _draw_grid(draw, viewport)
    for p, q in zip(viewport.pixels(step.p), viewport.pixels(step.q), strict=True):
        draw.line((p, q), fill=LINK, width=1)
    _draw_scan(draw, viewport, pair.target, palette.OCCUPIED, TARGET_DOT)
    _draw_arrow(draw, viewport, SE2(), palette.OCCUPIED)
    _draw_scan(draw, viewport, step.T_target_source.transform(pair.source), palette.SCAN, SOURCE_DOT)
    _draw_arrow(draw, viewport, step.T_target_source, palette.SCAN)
    picture = Image.new("RGB", (viewport.size[0] // FINE, viewport.size[1] // FINE + HEADER + CURVE), palette.PAGE)
    picture.paste(fine.reduce(FINE), (0, HEADER))
    _draw_header(ImageDraw.Draw(picture), pair.title, f"step {number} of {len(steps) - 1}")
    picture.paste(_curve(steps, number, picture.width).reduce(FINE), (0, picture.height - CURVE))
    _draw_footer(ImageDraw.Draw(picture), step, picture.height)
    return picture


def _draw_grid(draw: ImageDraw.ImageDraw, viewport: Viewport) -> None:
    """One line a metre."""
    width, height = viewport.size
    right, bottom = viewport.left + width / viewport.scale, viewport.top - height / viewport.scale
    for x in range(math.ceil(viewport.left), math.floor(right) + 1):
        draw.line(viewport.pixels(np.array([[x, bottom], [x, viewport.top]])), fill=GRID, width=FINE)
    for y in range(math.ceil(bottom), math.floor(viewport.top) + 1):
        draw.line(viewport.pixels(np.array([[viewport.left, y], [right, y]])), fill=GRID, width=FINE)


def _draw_scan(draw: ImageDraw.ImageDraw, viewport: Viewport, points: FloatArray, colour: str, radius: float) -> None:
    r = radius * FINE
    for x, y in viewport.pixels(points):
        draw.ellipse((x - r, y - r, x + r, y + r), fill=colour)


def _draw_arrow(draw: ImageDraw.ImageDraw, viewport: Viewport, pose: SE2, colour: str) -> None:
    """Where the scan was seen from."""
    size = ARROW * FINE / viewport.scale
    draw.polygon(viewport.pixels(pose.transform(size * np.array([[1.4, 0.0], [-1.0, 0.9], [-0.5, 0.0], [-1.0, -0.9]]))), fill=colour)


def _draw_header(draw: ImageDraw.ImageDraw, title: str, progress: str) -> None:
    draw.text((14, 9), f"ICP: {title}", fill=palette.INK, font=ImageFont.load_default(18))
    draw.text((WIDTH - 14, 9), progress, fill=palette.INK, font=ImageFont.load_default(18), anchor="ra")
    font, x = ImageFont.load_default(13), 14.0
    for label, colour in (("target", palette.OCCUPIED), ("source", palette.SCAN), ("correspondences", LINK)):
        draw.rectangle((x, 43, x + 14, 46), fill=colour)
        draw.text((x + 20, 45), label, fill=palette.MUTED, font=font, anchor="lm")
        x += 36 + draw.textlength(label, font)


def _curve(steps: Sequence[IcpStep], number: int, width: int) -> Image.Image:
    """The rms over the steps so far, fine."""
    fine = Image.new("RGB", (width * FINE, CURVE * FINE), palette.PAGE)
    draw = ImageDraw.Draw(fine)
    rms = np.array([step.rms for step in steps])
    left, right, top, bottom = 170 * FINE, (width - 20) * FINE, 14 * FINE, (CURVE - 16) * FINE
    xs = left + (right - left) * np.arange(len(steps)) / max(len(steps) - 1, 1)
    ys = bottom - (bottom - top) * rms / max(float(rms.max()), 1e-9)
    line = list(zip(xs.tolist(), ys.tolist(), strict=True))
    draw.line([(left, bottom), (right, bottom)], fill=GRID, width=FINE)
    draw.line(line, fill=AHEAD, width=2 * FINE, joint="curve")
    draw.line(line[: number + 1], fill=palette.ESTIMATE, width=2 * FINE, joint="curve")
    x, y = line[number]
    draw.ellipse((x - 4 * FINE, y - 4 * FINE, x + 4 * FINE, y + 4 * FINE), fill=palette.ESTIMATE)
    return fine


def _draw_footer(draw: ImageDraw.ImageDraw, step: IcpStep, height: int) -> None:
    draw.text((14, height - CURVE + 16), f"rms {1000.0 * step.rms:.1f} mm", fill=palette.ESTIMATE, font=ImageFont.load_default(18))
    draw.text((14, height - CURVE + 44), f"{len(step.p)} pairs", fill=palette.MUTED, font=ImageFont.load_default(13))
