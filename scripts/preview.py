"""The plan of a world as a picture: what stands in it, its markers, the start and the tour."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Polygon
from matplotlib.ticker import MultipleLocator

from worlds.parts import Wall
from worlds.world import ROBOT_HEIGHT, ROBOT_RADIUS, Solid, World

INK, FLOOR, GRID = "#2b2f36", "#fbfaf7", "#dfddd6"
WALL, FIXED, MOVABLE, TOUR, ROBOT = "#4a4e57", "#c9a26d", "#e4572e", "#2f7fb8", "#2a9d54"
DOOR, PERSON, POSTER = "#8c5a2b", "#a03c99", "#d9a900"
SHADES = {"matte": 1.0, "dark": 1.0, "glossy": 0.75, "glass": 0.3}
"""Opacity of a material."""
MARGIN = 0.55
"""Free paper around the world [m]."""


def draw_world(world: World) -> Figure:
    """Plan of a world, one metre a grid line; save it with `savefig`."""
    x0, y0, x1, y1 = world.bounds
    width, height = x1 - x0 + 2 * MARGIN, y1 - y0 + 2 * MARGIN
    scale = min(14.0 / width, 10.0 / height)
    figure = Figure(figsize=(width * scale + 0.8, height * scale + 1.7), dpi=130, facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    _style(axes, world)
    for solid in world.solids:
        axes.add_patch(_patch(solid))
    _draw_doors(axes, world)
    _draw_markers(axes, world)
    _draw_posters(axes, world)
    _draw_tour(axes, world)
    _draw_people(axes, world)
    _draw_robot(axes, world)
    axes.legend(handles=_legend(world), loc="upper center", bbox_to_anchor=(0.5, -0.62 / (height * scale)), ncols=10, frameon=False)
    figure.tight_layout()
    return figure


def _style(axes: Axes, world: World) -> None:
    x0, y0, x1, y1 = world.bounds
    axes.set(xlim=(x0 - MARGIN, x1 + MARGIN), ylim=(y0 - MARGIN, y1 + MARGIN), aspect="equal", xlabel="x [m]", ylabel="y [m]")
    axes.set_title(world.name, loc="left", fontsize=15, fontweight="bold", color=INK, parse_math=False)
    axes.set_title(world.description, loc="right", fontsize=10, color=INK, parse_math=False)
    axes.set_facecolor(FLOOR)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(1.0))
    axes.grid(color=GRID, linewidth=0.8)
    axes.set_axisbelow(True)
    axes.tick_params(color=GRID, labelcolor=INK)
    axes.spines[:].set_color(GRID)


def _patch(solid: Solid) -> Polygon:
    if isinstance(solid, Wall):
        return Polygon(solid.footprint(), facecolor=WALL, edgecolor=WALL, linewidth=0.5, alpha=SHADES[solid.material], zorder=3)
    if solid.z_span[0] >= ROBOT_HEIGHT:
        return Polygon(solid.footprint(), facecolor="none", edgecolor=FIXED, linewidth=1.4, linestyle=(0, (4, 3)), zorder=3)
    colour = MOVABLE if solid.mass > 0.0 else FIXED
    return Polygon(solid.footprint(), facecolor=colour, edgecolor=INK, linewidth=0.8, alpha=SHADES[solid.material], zorder=3)


def _draw_markers(axes: Axes, world: World) -> None:
    for marker in world.markers:
        corners, (x, y, _) = marker.corners(), marker.position
        normal = np.array([math.cos(marker.yaw), math.sin(marker.yaw)])
        axes.plot(corners[:2, 0], corners[:2, 1], color="black", linewidth=3.2, solid_capstyle="butt", zorder=5)
        axes.plot([x, x + 0.08 * normal[0]], [y, y + 0.08 * normal[1]], color="black", linewidth=0.9, zorder=5)
        axes.text(x - 0.22 * normal[0], y - 0.22 * normal[1], str(marker.id), fontsize=6.5, ha="center", va="center", color=INK, zorder=6)


def _draw_posters(axes: Axes, world: World) -> None:
    for hung in (*world.posters, *world.boards):
        corners = hung.corners()
        axes.plot(corners[:2, 0], corners[:2, 1], color=POSTER, linewidth=3.0, solid_capstyle="butt", zorder=5)


def _draw_doors(axes: Axes, world: World) -> None:
    """Leaves where they are at first, and the way of their edges."""
    for door in world.doors:
        axes.add_patch(Polygon(door.footprint(), facecolor=DOOR, edgecolor=DOOR, alpha=SHADES[door.material], zorder=4))
        yaws = np.linspace(door.yaw, door.yaw + door.opening, 20)
        way = np.array(door.hinge) + door.width * np.column_stack([np.cos(yaws), np.sin(yaws)])
        axes.plot(way[:, 0], way[:, 1], color=DOOR, linewidth=0.8, linestyle="-" if door.state == "swinging" else ":", zorder=4)


def _draw_people(axes: Axes, world: World) -> None:
    for person in world.people:
        corners = np.array([*person.path, person.path[0]])
        axes.plot(corners[:, 0], corners[:, 1], color=PERSON, linewidth=1.1, linestyle=(0, (2, 2)), zorder=4)
        axes.plot(*person.path[0], "o", color=PERSON, markersize=8, zorder=6)


def _draw_tour(axes: Axes, world: World) -> None:
    if not world.tour:
        return
    corners = np.array([*world.tour, world.tour[0]])
    axes.plot(corners[:, 0], corners[:, 1], color=TOUR, linewidth=1.6, zorder=4)
    axes.plot(corners[:-1, 0], corners[:-1, 1], "o", color=TOUR, markersize=3.5, zorder=4)
    for a, b in world.legs():
        middle, direction = 0.4 * np.array(a) + 0.6 * np.array(b), (np.array(b) - a) / math.dist(a, b)  # off the middle: ways back show
        arrow = {"arrowstyle": "-|>", "color": TOUR, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", tuple(middle + 0.04 * direction), tuple(middle - 0.04 * direction), arrowprops=arrow, zorder=4)


def _draw_robot(axes: Axes, world: World) -> None:
    x, y, yaw = world.start
    axes.add_patch(Circle((x, y), ROBOT_RADIUS, facecolor=ROBOT, edgecolor=INK, alpha=0.85, zorder=7))
    tip = (x + 2.0 * ROBOT_RADIUS * math.cos(yaw), y + 2.0 * ROBOT_RADIUS * math.sin(yaw))
    axes.annotate("", tip, (x, y), arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0}, zorder=8)


def _legend(world: World) -> list[Patch | Line2D]:
    furniture = [*world.boxes, *world.cylinders]
    entries: list[tuple[Patch | Line2D, bool]] = [
        (Patch(color=WALL, label="wall"), True),
        (Patch(facecolor=FIXED, edgecolor=INK, label="furniture"), any(part.mass == 0.0 for part in furniture)),
        (Patch(facecolor=MOVABLE, edgecolor=INK, label="movable"), any(part.mass > 0.0 for part in furniture)),
        (_dashes("overhead"), any(part.z >= ROBOT_HEIGHT for part in furniture)),
        (Line2D([], [], color=DOOR, linewidth=3.2, label="door"), bool(world.doors)),
        (Line2D([], [], color="black", linewidth=3.2, label="marker, id"), bool(world.markers)),
        (Line2D([], [], color=POSTER, linewidth=3.2, label="poster"), bool(world.posters)),
        (Line2D([], [], color=PERSON, marker="o", linestyle=":", label="person"), bool(world.people)),
        (Line2D([], [], color=TOUR, marker="o", markersize=3.5, label="tour"), bool(world.tour)),
        (Line2D([], [], color=ROBOT, marker="o", markersize=9, linestyle="", label="start"), True),
    ]
    return [entry for entry, shown in entries if shown]


def _dashes(label: str) -> Patch:
    return Patch(facecolor="none", edgecolor=FIXED, linestyle="--", label=label)
