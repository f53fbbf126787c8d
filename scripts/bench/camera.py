"""`twin bench camera`: speed and accuracy of the simulated camera, against the formulas and against PyBullet's renderer."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hardware.spec import RobotSpec
from scripts.bench.corners import fitted_corners
from scripts.bench.row import Row
from sim.camera_errors import DATASHEET, CameraErrors
from sim.camera_truth import seen_corners
from sim.film import Film, Stereo
from sim.living import Living
from sim.painters import PAINTERS
from sim.raster.kernels.views import Views
from sim.raster.painter import Painter
from sim.robot import Sim
from sim.scenery import Scenery
from slam.messages import Twist
from slam.se2 import FloatArray
from slam.se3 import SE3
from worlds.loader import load_world
from worlds.parts import Wall
from worlds.world import World

SIZE = "848 x 480"
PEER = "PyBullet TinyRenderer"
DISTANCES = (0.5, 1.0, 2.0, 3.0, 4.0)
"""At which the depth's error is compared with the formula [m]."""


def run(smoke: bool) -> list[Row]:
    """Rows of the camera in the aruco_room."""
    bench = _Bench.of("aruco_room")
    views = list(bench.standing(3 if smoke else 12))
    return [
        *_speed_rows(bench, views, 1 if smoke else 5),
        *_corner_rows(bench, 4 if smoke else 100),
        *(_depth_row(distance) for distance in DISTANCES),
        *_parity_rows(bench, views[: 1 if smoke else 6]),
        Row("camera", "whole twin with RGB-D at 15 Hz, two threads", _real_time_factor(2.0 if smoke else 20.0), "x", "≥ 1.5"),
    ]


@dataclass(frozen=True)
class _Bench:
    """One world and one robot in it."""

    world: World
    scenery: Scenery
    painter: Painter
    spec: RobotSpec

    @classmethod
    def of(cls, name: str) -> _Bench:
        world = load_world(name)
        scenery = Scenery(world, Living(world))
        return cls(world, scenery, PAINTERS["raster"](scenery), RobotSpec())

    def standing(self, count: int) -> Iterator[Views]:
        """Views from places along the tour."""
        for (x, y), (u, v) in self.world.legs()[:: max(len(self.world.legs()) // count, 1)]:
            yield self.view(x, y, math.atan2(v - y, u - x))

    def view(self, x: float, y: float, yaw: float) -> Views:
        return self.scenery.views_of(SE3.from_xyz_rpy((x, y, 0.0), (0.0, 0.0, yaw)) @ self.spec.T_base_camera)

    def picture(self, painter: Painter, views: Views) -> NDArray[np.float32]:
        colour = self.spec.require_camera().colour
        return painter.colours(colour, views, painter.see(colour, views), 1.0)


def _speed_rows(bench: _Bench, views: list[Views], rounds: int) -> list[Row]:
    camera, rng = bench.spec.require_camera(), np.random.default_rng(0)
    tiny = PAINTERS["tiny"](bench.scenery)
    film, stereo = Film(camera.colour, DATASHEET, bench.scenery.faces, rng), Stereo(camera, DATASHEET, bench.scenery.faces, rng)
    moving = [_turning(bench, view) for view in views]

    def pair(k: int) -> None:
        film.expose(bench.painter, moving[k], 1.0, film.draw())
        stereo.measure(bench.painter, views[k], stereo.draw())

    contenders: list[Callable[[int], object]] = [
        lambda k: bench.picture(bench.painter, views[k]),
        lambda k: tiny.colours(camera.colour, views[k], np.zeros((camera.colour.height, camera.colour.width), np.int32), 1.0),
        pair,
    ]
    clean, peer, full = (_rate(contender, len(views), rounds) for contender in contenders)
    full_name = f"colour and depth {SIZE}, full datasheet model while turning at 0.5 rad/s, a second of one core"
    return [
        Row(
            "camera",
            f"colour {SIZE}, clean, filtered, a second of one core",
            clean,
            "images/s",
            "≥ 60; ratio ≥ 6",
            PEER,
            peer,
            clean / peer,
        ),
        Row("camera", full_name, 2.0 * full, "images/s", "≥ 40"),
    ]


def _rate(work: Callable[[int], object], count: int, rounds: int) -> float:
    """Calls a second of this thread's processor time, whatever else runs: median over rounds of `count` calls, after one to warm up."""
    work(0)
    seconds: list[float] = []
    for _ in range(rounds):
        began = time.thread_time()
        for k in range(count):
            work(k)
        seconds.append((time.thread_time() - began) / count)
    return 1.0 / float(np.median(seconds))


def _turning(bench: _Bench, views: Views) -> tuple[Views, Views]:
    """Views of every row, and at the ends of the exposure, of a camera that turns at 0.5 rad/s."""
    colour = bench.spec.require_camera().colour
    return _turned(views, 0.5 * colour.row_times()), _turned(views, 0.5 * DATASHEET.exposure * np.array([-0.5, 0.5]))


def _turned(views: Views, angles: FloatArray) -> Views:
    """The same views, once for each angle [rad] about the camera's upright axis."""
    turns = np.stack([SE3.from_xyz_rpy((0.0, 0.0, 0.0), (0.0, angle, 0.0)).R for angle in angles.tolist()])
    return np.ascontiguousarray(turns @ views[0]), np.repeat(views[1], len(angles), axis=1)


def _corner_rows(bench: _Bench, count: int) -> list[Row]:
    errors = corner_errors(bench, count)
    outward = "corners from lines fitted to marker edges, 0.5 to 3 m, up to 65 deg"
    bias = float(np.abs(errors.mean(axis=(0, 1))).max())
    return [
        Row("camera", f"{outward}: RMS of {len(errors)} markers", float(np.sqrt(np.mean(errors**2))), "px", "≤ 0.05"),
        Row("camera", f"{outward}: bias", bias, "px", "≤ 0.01"),
    ]


def corner_errors(bench: _Bench, count: int, seed: int = 0) -> FloatArray:
    """Fitted less true corners (N, 4, 2) [px] of the markers seen from random places."""
    rng, colour = np.random.default_rng(seed), bench.spec.require_camera().colour
    half = 0.5 * min(bench.world.bounds[2:]) - 0.1
    errors: list[FloatArray] = []
    while len(errors) < count:
        views = bench.view(*rng.uniform(-half, half, 2).tolist(), rng.uniform(-math.pi, math.pi))
        ids = bench.painter.see(colour, views)
        grey = np.rint(bench.painter.colours(colour, views, ids, 1.0)).astype(np.float64).mean(axis=2)
        for face, marker in bench.scenery.marker_faces(bench.world):
            away = views[1][0, 0] - marker.corners().mean(axis=0)
            distance = float(np.linalg.norm(away))
            slant = away @ (math.cos(marker.yaw), math.sin(marker.yaw), 0.0) / distance
            corners = seen_corners(marker, face, colour, views, ids)
            if corners is not None and 0.5 <= distance <= 3.0 and slant >= math.cos(math.radians(65.0)):
                errors.append(fitted_corners(grey, corners, colour) - corners)
    return np.array(errors)


def _depth_row(distance: float) -> Row:
    measured, formula = depth_rms(distance)
    return Row("camera", f"depth RMS over that of z^2 s / (f B), at {distance:g} m", measured / formula, "", "0.9 to 1.1")


def depth_rms(distance: float) -> tuple[float, float]:
    """RMS of the depth's error [m] before a wall at a distance [m], and the formula's."""
    wall = Wall((distance + 0.05, -20.0), (distance + 0.05, 20.0), 0.1, 30.0)
    bench = _Bench(world := World(name="wall", walls=(wall,), start=(-1.0, 0.0, 0.0)), *_empty(world))
    camera = bench.spec.require_camera()
    level = SE3(np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), np.array([0.0, 0.0, 15.0]))
    views = bench.scenery.views_of(level)
    noisy = CameraErrors(subpixel=DATASHEET.subpixel, patch=DATASHEET.patch, disparity_steps=DATASHEET.disparity_steps)
    stereo = Stereo(camera, noisy, bench.scenery.faces, np.random.default_rng(1))
    errors = [stereo.measure(bench.painter, views, stereo.draw()) - distance for _ in range(5)]
    formula = distance**2 * DATASHEET.subpixel / (camera.depth.focal[0] * camera.baseline)
    return float(np.sqrt(np.nanmean(np.square(errors)))), formula


def _empty(world: World) -> tuple[Scenery, Painter, RobotSpec]:
    scenery = Scenery(world, Living(world))
    return scenery, PAINTERS["raster"](scenery), RobotSpec()


def _parity_rows(bench: _Bench, views: list[Views]) -> list[Row]:
    near, colours = zip(*((_depth_parity(bench, view), _psnr(bench, view)) for view in views), strict=True)
    return [
        Row("camera", "depth against Embree, off edges within 1 mm", 100.0 * min(near), "%", "≥ 99.5", "Embree"),
        Row("camera", "colours against TinyRenderer, the worst view", min(colours), "dB", "≥ 25", PEER),
    ]


def _depth_parity(bench: _Bench, views: Views) -> float:
    """Share of the pixels off edges whose depth is that of Embree within 1 mm."""
    imager = bench.spec.require_camera().depth
    depths = [painter.depths(imager, views, painter.see(imager, views)) for painter in (bench.painter, PAINTERS["embree"](bench.scenery))]
    exact = depths[1]
    jumps = np.maximum(np.abs(np.diff(exact, axis=0))[:, :-1], np.abs(np.diff(exact, axis=1))[:-1])
    off_edges = np.zeros(exact.shape, bool)
    off_edges[1:-1, 1:-1] = (jumps[1:, 1:] < 0.05) & (jumps[:-1, :-1] < 0.05)
    return float(np.mean(np.abs(depths[0] - exact)[off_edges] <= 0.001))


def _psnr(bench: _Bench, views: Views) -> float:
    """Peak signal-to-noise ratio [dB] of our picture against TinyRenderer's, both before our sky."""
    colour = bench.spec.require_camera().colour
    ids = bench.painter.see(colour, views)
    ours, theirs = (painter.colours(colour, views, ids, 1.0) for painter in (bench.painter, PAINTERS["tiny"](bench.scenery)))
    return float(10.0 * np.log10(255.0**2 / np.mean(np.square(ours - theirs))))


def _real_time_factor(duration: float) -> float:
    with Sim(camera="raster").build() as robot:
        robot.clock.sleep_until(1.0)
        began = time.perf_counter()
        for tick in range(round(duration / 0.05)):
            robot.clock.sleep_until(1.0 + tick * 0.05)
            robot.read()
            robot.drive(Twist(0.15 * math.sin(0.1 * tick), 0.5))
        return duration / (time.perf_counter() - began)
