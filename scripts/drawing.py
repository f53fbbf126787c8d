"""Draws the robot with its dimensions from its specification: `python -m scripts.drawing` writes `docs/robot.png`."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from hardware import chassis
from hardware.chassis import Part
from hardware.spec import RobotSpec
from scripts.runs.files import write_via
from scripts.runs.palette import INK, MUTED, SCAN
from slam.se3 import SE3

mpl.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon, Rectangle

DEFAULT = Path(__file__).parents[1] / "docs" / "robot.png"
MM = 1000.0
SIDE, TOP = (0, 2), (0, 1)
"""Axes of `base` that a view shows: to the right and up on paper."""
LABELS = {
    SIDE: {
        "brick": ("EV3 brick", (-150, 95)),
        "motor_right": ("large motors", (-150, 62)),
        "lidar": ("URG-04LX", (118, 140)),
        "camera": ("camera, 15° up", (112, 224)),
        "mast": ("mast, in the blind sector", (-112, 205)),
        "gyro": ("gyro", (-150, 124)),
        "caster_holder": ("caster", (-150, 26)),
    },
    TOP: {},
}


def main(argv: list[str]) -> int:
    """Write the drawing to the path given, or to docs/robot.png."""
    path = Path(argv[0]) if argv else DEFAULT
    figure, (side, top) = plt.subplots(1, 2, figsize=(15, 7.4), width_ratios=(1.18, 1.0))
    spec = RobotSpec()
    _draw_side(side, spec)
    _draw_top(top, spec)
    mass = sum(part.mass for part, _ in placed_parts(spec)) + 2 * chassis.WHEEL_MASS + chassis.CASTER_MASS
    figure.suptitle(f"bricktwin: {mass * MM:.0f} g, lengths in mm, frames after REP 103", color=INK, fontsize=15)
    figure.tight_layout()
    write_via(path, lambda partial: figure.savefig(partial, dpi=110))
    print(f"wrote {path}")
    return 0


def placed_parts(spec: RobotSpec) -> list[tuple[Part, SE3]]:
    """Parts of body and sensors with the pose of their frames in base."""
    optical = SE3(np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]))
    parts = [(part, SE3()) for part in chassis.BODY]
    if spec.lidar is not None:
        parts.append((chassis.LIDAR, spec.lidar.T_base_laser))
    if spec.imu is not None:
        parts.append((chassis.GYRO, spec.imu.T_base_imu))
    return [*parts, (chassis.CAMERA, spec.T_base_camera @ optical)]


def silhouette(part: Part, T_base_part: SE3, view: tuple[int, int]) -> NDArray[np.float64]:
    """Corners (N, 2) [mm] of a part as a view shows it."""
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    corners = T_base_part.transform(np.array(part.centre) + signs * np.array(part.size) / 2)[:, view] * MM
    return corners[ConvexHull(corners).vertices]


def _draw_parts(axes: Axes, spec: RobotSpec, view: tuple[int, int]) -> None:
    depth = 3 - sum(view)
    ordered = sorted(placed_parts(spec), key=lambda placed: placed[1].t[depth] + placed[0].centre[depth])
    for part, T_base_part in ordered:
        corners = silhouette(part, T_base_part, view)
        axes.add_patch(Polygon(corners, facecolor=(*part.colour, 0.92), edgecolor=INK, linewidth=1.0))
        if part.name in LABELS[view]:
            text, place = LABELS[view][part.name]
            arrow = {"arrowstyle": "-", "color": MUTED, "linewidth": 0.8}
            axes.annotate(text, corners.mean(axis=0), place, color=INK, fontsize=10, va="center", arrowprops=arrow)


def _draw_side(axes: Axes, spec: RobotSpec) -> None:
    drive, lidar = spec.drive, spec.lidar
    if drive is None or lidar is None:
        raise SystemExit("the drawing shows a robot with a drive and a lidar")
    _draw_parts(axes, spec, SIDE)
    radius = drive.wheel_radii[0] * MM
    axes.add_patch(Circle((0, radius), radius, facecolor="#222222", edgecolor=INK, alpha=0.85))
    axes.add_patch(Circle((0, radius), 0.55 * radius, facecolor="#d9d9dc", edgecolor=INK))
    ball = chassis.CASTER_RADIUS * MM
    axes.add_patch(Circle((chassis.CASTER_CENTRE[0] * MM, ball), ball, facecolor="#b9bcc2", edgecolor=INK))
    plane, eye = lidar.T_base_laser.t * MM, spec.T_base_camera.t * MM
    axes.plot([plane[0], 150], [plane[2], plane[2]], color=SCAN, linestyle="--", linewidth=1.2)
    axes.text(150, plane[2] + 2, "scan plane", color=SCAN, fontsize=9, ha="right")
    axes.axhline(0.0, color=INK, linewidth=1.5)
    _height(axes, 172, float(eye[2]), "lens")
    _height(axes, 156, float(plane[2]), "scan plane")
    _length(axes, (0.0, float(plane[0])), -34)
    _length(axes, (0.0, float(eye[0])), -20)
    _length(axes, (chassis.CASTER_CENTRE[0] * MM, 0.0), -20)
    _height(axes, 46, 2 * radius, "⌀ wheel")
    _axes_cross(axes, ("x", "z"))
    _finish(axes, "from the right", (-160, 195), (-48, 245))


def _draw_top(axes: Axes, spec: RobotSpec) -> None:
    drive = spec.drive
    if drive is None:
        return
    _draw_parts(axes, spec, TOP)
    half, radius, width = drive.track * MM / 2, drive.wheel_radii[0] * MM, chassis.WHEEL_WIDTH * MM
    for y in (-half, half):
        axes.add_patch(Rectangle((-radius, y - width / 2), 2 * radius, width, facecolor="#222222", edgecolor=INK, alpha=0.85))
    axes.add_patch(Circle((0, 0), spec.radius * MM, fill=False, edgecolor=MUTED, linestyle=":"))
    axes.text(-spec.radius * MM * 0.72, spec.radius * MM * 0.75, f"radius {spec.radius * MM:.0f}", color=MUTED, fontsize=9, ha="right")
    _measure(axes, (108, -half), (108, half), f"track {drive.track * MM:.0f}")
    (x, y, _), (cx, _, _) = (np.array(chassis.HULL_SIZE) * MM), (np.array(chassis.HULL_CENTRE) * MM)
    axes.add_patch(Rectangle((cx - x / 2, -y / 2), x, y, fill=False, edgecolor=MUTED, linestyle="--"))
    axes.text(cx + x / 2, y / 2 + 4, "what bumps", color=MUTED, fontsize=9, ha="right")
    _measure(axes, (cx - x / 2, -112), (cx + x / 2, -112), f"{x:.0f}")
    _measure(axes, (-128, -y / 2), (-128, y / 2), f"{y:.0f}")
    _axes_cross(axes, ("x", "y"))
    _finish(axes, "from above", (-160, 160), (-140, 140))


def _height(axes: Axes, x: float, height: float, name: str) -> None:
    _measure(axes, (x, 0.0), (x, height), f"{name} {height:.0f}")


def _length(axes: Axes, span: tuple[float, float], z: float) -> None:
    _measure(axes, (span[0], z), (span[1], z), f"{abs(span[1] - span[0]):.0f}")


def _measure(axes: Axes, a: tuple[float, float], b: tuple[float, float], text: str) -> None:
    """A dimension line between two points, with its text beside its middle."""
    upright = a[0] == b[0]
    axes.annotate("", a, b, arrowprops={"arrowstyle": "<->", "color": INK, "linewidth": 0.9, "shrinkA": 0, "shrinkB": 0})
    middle = ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2)
    offset = (4, 0) if upright else (0, 4)
    axes.annotate(
        text,
        middle,
        offset,
        textcoords="offset points",
        rotation=90 if upright else 0,
        fontsize=9.5,
        color=INK,
        ha="left" if upright else "center",
        va="center" if upright else "bottom",
    )


def _axes_cross(axes: Axes, names: tuple[str, str]) -> None:
    """The axes of `base` at its origin."""
    for name, end, colour in zip(names, ((30, 0), (0, 30)), ("#c92a2a", "#2b8a3e"), strict=True):
        axes.annotate("", end, (0, 0), arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 2.0}, zorder=10)
        axes.annotate(name, end, (3, 3), textcoords="offset points", color=colour, fontsize=12, weight="bold", zorder=10)


def _finish(axes: Axes, title: str, across: tuple[float, float], up: tuple[float, float]) -> None:
    axes.set_title(title, color=INK)
    axes.set_xlim(across)
    axes.set_ylim(up)
    axes.set_aspect("equal")
    axes.axis("off")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
