"""`run.gif`: the run as it happened, the map growing under the robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from scripts.runs import palette
from scripts.runs.ellipses import crosses, draw_cross
from scripts.runs.files import write_via
from scripts.runs.record import KeyFrame, RunRecord
from scripts.runs.scene import Scene, lay_out
from slam.evaluation.poses import sample
from slam.messages import Trajectory
from slam.se2 import SE2, FloatArray

MOST_FRAMES = 70
FRAME_MS, LAST_FRAME_MS = 140, 1800
WIDTH, HEIGHT, HEADER = 760, 640, 58
"""Largest picture of the map and height of the text above it [px]."""
FINE = 2
"""Everything is drawn this much larger and averaged, for smooth lines."""
COLOURS = 64
ROBOT_RADIUS = 0.13
"""[m]"""


@dataclass(frozen=True, slots=True)
class Viewport:
    """Where the world lies in the fine picture."""

    scale: float
    """[px/m]"""
    left: float
    top: float
    """World coordinates of the picture's corner [m]."""
    size: tuple[int, int]
    """Fine pixels."""

    def pixels(self, points: FloatArray) -> list[tuple[float, float]]:
        """Pixels of world points (N, 2)."""
        return list(zip((self.scale * (points[:, 0] - self.left)).tolist(), (self.scale * (self.top - points[:, 1])).tolist(), strict=True))


def write_gif(path: Path, run: RunRecord) -> None:
    """Write the animation of a run's key frames, at most 12 s long; without key frames, of its last moment.

    Raises:
        OutputError: the file cannot be written.
        TrajectoryError: truth and estimate do not overlap in time.
    """
    scene = lay_out(run)
    viewport = _viewport(scene)
    chosen = run.key_frames or (_last_moment(run),)
    indices = np.unique(np.linspace(0, len(chosen) - 1, MOST_FRAMES).round().astype(int))
    pictures = [_draw_frame(run, scene, viewport, chosen[index]) for index in indices]
    colours = pictures[-1].quantize(COLOURS, dither=Image.Dither.NONE)
    frames = [picture.quantize(palette=colours, dither=Image.Dither.NONE) for picture in pictures]
    durations = [FRAME_MS] * (len(frames) - 1) + [LAST_FRAME_MS]
    write_via(path, lambda partial: frames[0].save(partial, save_all=True, append_images=frames[1:], duration=durations, loop=0))


def _viewport(scene: Scene) -> Viewport:
    x_min, x_max, y_min, y_max = scene.bounds
    scale = FINE * min(WIDTH / (x_max - x_min), HEIGHT / (y_max - y_min))
    width = max(round(scale * (x_max - x_min) / FINE), WIDTH // 2)
    height = round(scale * (y_max - y_min) / FINE)
    left = 0.5 * (x_min + x_max) - 0.5 * width * FINE / scale
    return Viewport(scale, left, y_max, (width * FINE, height * FINE))


def _last_moment(run: RunRecord) -> KeyFrame:
    pose = SE2.from_array(run.estimate.poses[-1]) if len(run.estimate) else SE2()
    stamp = float(run.estimate.stamps[-1]) if len(run.estimate) else 0.0
    return KeyFrame(stamp, pose, run.map.geometry, run.map.states(), np.empty((0, 2)))


def _draw_frame(run: RunRecord, scene: Scene, viewport: Viewport, frame: KeyFrame) -> Image.Image:
    fine = _map_picture(frame, scene, viewport)
    draw = ImageDraw.Draw(fine)
    for segment in scene.walls.reshape(-1, 2, 2):
        draw.line(viewport.pixels(segment), fill=palette.TRUTH, width=FINE)
    if scene.truth is not None:
        _draw_path(draw, viewport, scene.truth, frame.stamp, palette.TRUTH_PALE, 6)
    _draw_path(draw, viewport, scene.odometry, frame.stamp, palette.ODOMETRY)
    _draw_path(draw, viewport, scene.estimate, frame.stamp, palette.ESTIMATE)
    for x, y in viewport.pixels(scene.T_world_map.transform(frame.points)):
        draw.rectangle((x - FINE, y - FINE, x + FINE, y + FINE), fill=palette.SCAN)
    _draw_robot(draw, viewport, scene.T_world_map @ frame.T_map_base)
    for x, y in viewport.pixels(scene.T_world_map.transform(frame.particles[:, :2])):
        draw.ellipse((x - FINE, y - FINE, x + FINE, y + FINE), fill=palette.PARTICLES)
    draw_cross(draw, viewport.pixels(crosses([frame], scene.T_world_map).reshape(-1, 2)), FINE)
    picture = Image.new("RGB", (fine.width // FINE, fine.height // FINE + HEADER), palette.PAGE)
    picture.paste(fine.reduce(FINE), (0, HEADER))
    elapsed = max(0.0, frame.stamp - (float(run.estimate.stamps[0]) if len(run.estimate) else frame.stamp))
    entries = [("estimate", palette.ESTIMATE), ("odometry", palette.ODOMETRY), ("scan", palette.SCAN)]
    entries += [("particles", palette.PARTICLES)] if len(run.beliefs.stamps) else []
    entries += [("truth", palette.TRUTH)] if scene.truth is not None else []
    _draw_header(ImageDraw.Draw(picture), picture.width, run.title, f"{elapsed:.1f} s", entries)
    return picture


def _map_picture(frame: KeyFrame, scene: Scene, viewport: Viewport) -> Image.Image:
    colours = np.array([_rgb(palette.FREE), _rgb(palette.OCCUPIED), _rgb(palette.UNKNOWN)], np.uint8)
    cells = Image.fromarray(colours[np.select([frame.states == 0, frame.states == 100], [0, 1], 2)])
    T = (scene.T_world_map @ frame.geometry.T_map_grid).inverse()
    metres, resolution = 1.0 / viewport.scale, frame.geometry.resolution
    R = T.rotation() / resolution
    column, row = T.transform(np.array([[viewport.left, viewport.top]]))[0] / resolution
    coefficients = (R[0, 0] * metres, -R[0, 1] * metres, column, R[1, 0] * metres, -R[1, 1] * metres, row)
    return cells.transform(viewport.size, Image.Transform.AFFINE, coefficients, Image.Resampling.NEAREST, fillcolor=palette.UNKNOWN)


def _rgb(colour: str) -> tuple[int, int, int]:
    red, green, blue = bytes.fromhex(colour[1:])
    return red, green, blue


def _draw_path(draw: ImageDraw.ImageDraw, viewport: Viewport, path: Trajectory, until: float, colour: str, width: int = 2) -> None:
    count = int(np.searchsorted(path.stamps, until, side="right"))
    if count == 0:
        return
    step = 1 + len(path) // 1500
    points = np.concatenate([path.poses[:count:step, :2], sample(path, np.array([until]))[:, :2]])
    draw.line(viewport.pixels(points), fill=colour, width=width * FINE, joint="curve")


def _draw_robot(draw: ImageDraw.ImageDraw, viewport: Viewport, pose: SE2) -> None:
    ((x, y),) = viewport.pixels(np.array([[pose.x, pose.y]]))
    radius = max(ROBOT_RADIUS * viewport.scale, 6.0 * FINE)
    draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=palette.PAGE, outline=palette.ESTIMATE, width=2 * FINE)
    tip, back = 0.75 * radius, 0.5 * radius
    arrow = np.array([[tip, 0.0], [-back, back], [-0.4 * back, 0.0], [-back, -back]])
    turned = arrow @ SE2(yaw=pose.yaw).rotation().T
    draw.polygon([(x + float(dx), y - float(dy)) for dx, dy in turned], fill=palette.ESTIMATE)


def _draw_header(draw: ImageDraw.ImageDraw, width: int, title: str, elapsed: str, entries: Sequence[tuple[str, str]]) -> None:
    draw.text((14, 8), title, fill=palette.INK, font=ImageFont.load_default(18))
    draw.text((width - 14, 8), elapsed, fill=palette.INK, font=ImageFont.load_default(18), anchor="ra")
    font, x = ImageFont.load_default(13), 14.0
    for label, colour in entries:
        draw.rectangle((x, 41, x + 14, 44), fill=colour)
        draw.text((x + 20, 43), label, fill=palette.MUTED, font=font, anchor="lm")
        x += 36 + draw.textlength(label, font)
