"""The body of a person: rigid parts made of round cones, with the colours of skin and clothes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slam.se2 import FloatArray
from worlds.parts import Material

Colour = tuple[int, int, int]
Place = tuple[float, float, float]

TRUNK, ARM, FOREARM, THIGH, SHANK, FOOT = 0, 1, 3, 5, 7, 9
"""Number of a part; of those that come in pairs the left one, the right one is the next."""
PARTS = 11

HIP, KNEE, ANKLE = 0.530, 0.285, 0.039
"""Heights of the joints of one who stands, as shares of the height (Drillis and Contini 1966, as in Winter, Biomechanics, figure 4.1)."""
SHOULDER, UPPER_ARM, LOWER_ARM = 0.818, 0.186, 0.146
"""Height of the shoulder and lengths of the arm down to the wrist, as shares of the height (ibidem)."""
SHOULDER_ASIDE, HIP_ASIDE = 0.115, 0.050
"""How far the joints are from the middle plane, as shares of the height."""
MIDDLES = {TRUNK: 0.75, ARM: SHOULDER - UPPER_ARM / 2, FOREARM: SHOULDER - UPPER_ARM - LOWER_ARM / 2}
"""Height of a part's origin in one who stands, as a share of the height."""

SIDES, RINGS = 14, 4
"""Of a cone, and of each of its round ends."""
SKIN = ((224, 182, 150), (198, 146, 112), (150, 102, 72), (96, 64, 46))
HAIR = ((40, 32, 28), (92, 64, 40), (170, 136, 84), (130, 128, 126))
SHIRTS = ((170, 40, 44), (36, 70, 140), (60, 120, 70), (214, 206, 190), (40, 42, 48), (206, 140, 40))
TROUSERS = ((34, 40, 62), (48, 46, 44), (84, 72, 58), (58, 74, 104))
SHOES = ((26, 24, 24), (90, 60, 40), (150, 150, 150))


class Cone(NamedTuple):
    """A round cone: the hull of two spheres, in a part's frame, all as shares of the height."""

    a: Place
    b: Place
    radius_a: float
    radius_b: float
    colour: Colour


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A rigid part. Its frame: x forward, y left, z up in one who stands, origin in its middle."""

    meshes: tuple[tuple[FloatArray, Colour], ...]
    """Triangles (M, 3, 3) [m], counter-clockwise from outside, of each piece, and its colour: red, green, blue, 0 to 255."""
    material: Material = "matte"

    @property
    def triangles(self) -> NDArray[np.float32]:
        """(M, 3, 3) of all pieces [m]."""
        return np.concatenate([triangles for triangles, _ in self.meshes]).astype(np.float32)

    @property
    def radius(self) -> float:
        """Of a sphere about the origin that holds it [m]."""
        return float(np.linalg.norm(self.triangles, axis=-1).max())


def figure(height: float, seed: int) -> tuple[Part, ...]:
    """The parts of a person of a height [m], in clothes drawn by `seed`."""
    rng = np.random.default_rng(seed)
    skin, hair, shirt, trousers, shoe = (choice[int(rng.integers(len(choice)))] for choice in (SKIN, HAIR, SHIRTS, TROUSERS, SHOES))
    girth = float(rng.uniform(0.92, 1.12))
    sleeve = shirt if rng.random() < 0.6 else skin
    cones = {
        TRUNK: _trunk(skin, hair, shirt, trousers),
        ARM: [_upright(UPPER_ARM, 0.027, 0.023, shirt)],
        FOREARM: _forearm(sleeve, skin),
        THIGH: [_upright(HIP - KNEE, 0.050, 0.038, trousers)],
        SHANK: [_upright(KNEE - ANKLE, 0.036, 0.031, trousers)],
        FOOT: [Cone((-0.020, 0.0, -0.012), (0.085, 0.0, -0.020), 0.026, 0.018, shoe)],
    }
    pair = {part: _part(pieces, height, girth) for part, pieces in cones.items()}
    return (pair[TRUNK], *(pair[part] for part in (ARM, FOREARM, THIGH, SHANK, FOOT) for _ in range(2)))


def round_cone(cone: Cone) -> FloatArray:
    """Triangles (M, 3, 3) of a round cone, counter-clockwise from outside."""
    a, b = np.array(cone.a), np.array(cone.b)
    along = b - a
    length = float(np.linalg.norm(along))
    axis = along / length
    side = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.9 else [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side)
    angles = np.arange(SIDES) * (2.0 * np.pi / SIDES)
    around = np.outer(np.cos(angles), side) + np.outer(np.sin(angles), np.cross(axis, side))  # (SIDES, 3)
    touch = float(np.arcsin(np.clip((cone.radius_a - cone.radius_b) / length, -0.999, 0.999)))
    low = [(a, cone.radius_a, latitude) for latitude in np.linspace(-np.pi / 2, touch, RINGS)]
    high = [(b, cone.radius_b, latitude) for latitude in np.linspace(touch, np.pi / 2, RINGS)]
    rings = np.array([p + r * (np.sin(latitude) * axis + np.cos(latitude) * around) for p, r, latitude in (*low, *high)])
    return _skin(rings)


def _skin(rings: FloatArray) -> FloatArray:
    """Triangles between neighbouring rings (R, N, 3), those without area left out."""
    begins, ends = rings[:-1], rings[1:]
    next_begins, next_ends = np.roll(begins, -1, axis=1), np.roll(ends, -1, axis=1)
    lower, upper = np.stack([begins, next_begins, next_ends], 2), np.stack([begins, next_ends, ends], 2)
    return np.concatenate([lower[1:].reshape(-1, 3, 3), upper[:-1].reshape(-1, 3, 3)])


def _part(cones: list[Cone], height: float, girth: float) -> Part:
    scaled = [(height * round_cone(cone._replace(radius_a=girth * cone.radius_a, radius_b=girth * cone.radius_b)), cone) for cone in cones]
    return Part(tuple((triangles, cone.colour) for triangles, cone in scaled))


def _upright(length: float, radius_top: float, radius_low: float, colour: Colour) -> Cone:
    return Cone((0.0, 0.0, length / 2), (0.0, 0.0, -length / 2), radius_top, radius_low, colour)


def _forearm(sleeve: Colour, skin: Colour) -> list[Cone]:
    hand = Cone((0.0, 0.0, -LOWER_ARM / 2 - 0.015), (0.0, 0.0, -LOWER_ARM / 2 - 0.075), 0.022, 0.014, skin)
    return [_upright(LOWER_ARM, 0.023, 0.018, sleeve), hand]


def _trunk(skin: Colour, hair: Colour, shirt: Colour, trousers: Colour) -> list[Cone]:
    """Pelvis, belly, chest, shoulders, neck, head and hair; z is given as height of one who stands."""

    def cone(a: Place, b: Place, radii: tuple[float, float], colour: Colour) -> Cone:
        return Cone((a[0], a[1], a[2] - MIDDLES[TRUNK]), (b[0], b[1], b[2] - MIDDLES[TRUNK]), *radii, colour)

    flanks = [cone((0.0, y, 0.60), (0.0, 1.45 * y, 0.765), (0.054, 0.056), shirt) for y in (0.038, -0.038)]
    return [
        cone((0.0, 0.036, 0.545), (0.0, -0.036, 0.545), (0.062, 0.062), trousers),
        *flanks,
        cone((0.0, 0.0, 0.60), (0.0, 0.0, 0.775), (0.060, 0.060), shirt),
        cone((0.0, SHOULDER_ASIDE - 0.012, 0.812), (0.0, 0.012 - SHOULDER_ASIDE, 0.812), (0.030, 0.030), shirt),
        cone((0.0, 0.0, 0.80), (0.006, 0.0, 0.875), (0.034, 0.032), skin),
        cone((0.012, 0.0, 0.907), (0.006, 0.0, 0.943), (0.040, 0.050), skin),
        cone((-0.008, 0.0, 0.935), (-0.002, 0.0, 0.950), (0.049, 0.0505), hair),
    ]
