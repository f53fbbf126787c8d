"""World -> flat faces with colours, textures and prints, for pictures."""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from sim.raster.kernels.faces import Shapes
from sim.scene import middle, standing_solids
from sim.textures import COLOURS, MARGIN, Cells, board_print, marker_print, poster_print
from slam.se2 import SE2, FloatArray
from worlds.parts import Cylinder, Material, Wall
from worlds.world import Solid, World

Colour = tuple[int, int, int]

MATERIALS: tuple[str, ...] = get_args(Material)
TEXTURES = tuple(COLOURS)
PRINT_LIFT = 1.001
"""How many times nearer a print is taken to be than the wall it hangs on."""
PRINT_THICKNESS = 3e-4
"""The same for rays, which meet one point only [m]."""
FLATNESS = 5e-4
"""How far the sides of a cylinder may be inside its circle [m]: less than the camera's depth tells."""
FLOOR_MARGIN = 1.0
"""Of floor outside the walls [m]."""
FURNITURE: tuple[Colour, ...] = (
    (150, 108, 70),
    (92, 110, 128),
    (196, 178, 150),
    (86, 60, 46),
    (120, 140, 104),
    (180, 92, 70),
    (70, 74, 82),
)
"""Colours of boxes and cylinders, chosen by their names."""
MATERIAL_COLOURS: dict[str, Colour] = {"dark": (28, 28, 30), "glass": (170, 200, 205)}
"""Colours of materials that have one whatever is made of them."""


@dataclass(frozen=True, slots=True, eq=False)
class Faces:
    """F flat convex faces of three or four corners, in the frames of the bodies that they belong to."""

    corners: FloatArray
    """(F, 4, 3) counter-clockwise as seen from outside; a triangle's last corner stands there twice [m]."""
    colours: NDArray[np.float32]
    """(F, 3) red, green, blue, 0 to 255, in the light of level 1."""
    textures: NDArray[np.int32]
    """(F,) place in `TEXTURES`, of which the first is none; below 0: -1 - k is the k-th of `prints`."""
    mappings: FloatArray
    """(F, 2, 4) U and u0: where on its texture a point p of the face is, U p + u0 [m]; on a print [cells], from its top left."""
    groups: NDArray[np.int32]
    """(F,) faces of one number are one smooth surface."""
    materials: NDArray[np.int32]
    """(F,) place in `MATERIALS`."""
    bodies: NDArray[np.int32]
    """(F,) body that it moves with; 0: the world itself."""
    prints: tuple[Cells, ...] = ()

    @property
    def planes(self) -> FloatArray:
        """(F, 4): outward unit normal n and distance d, n.p = d [m]."""
        normals = _normals(self.corners)
        return np.column_stack([normals, np.sum(normals * self.corners[:, 0], axis=1)])

    @property
    def lifts(self) -> NDArray[np.float32]:
        """(F,) how many times nearer a face is taken to be than it is."""
        return np.where(self.textures < 0, PRINT_LIFT, 1.0).astype(np.float32)

    @property
    def shapes(self) -> Shapes:
        """What the renderer's kernels need to know of where faces are."""
        return self.corners, self.planes, self.bodies, self.lifts

    def triangles(self, body: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Triangles (M, 3, 3) of one body and the face of each (M,); prints stand out a little [m]."""
        index = np.flatnonzero(self.bodies == body).astype(np.int32)
        out = np.where(self.textures[index] < 0, PRINT_THICKNESS, 0.0)[:, None, None] * self.planes[index, None, :3]
        corners = self.corners[index] + out
        triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
        return triangles.astype(np.float32), np.concatenate([index, index])


def joined(parts: Sequence[Faces]) -> Faces:
    """The faces of all parts, of which the k-th moves as body k; only the first has prints."""
    arrays = {
        field.name: np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Faces) if field.name != "prints"
    }
    counts = [len(part.corners) for part in parts]
    firsts = np.cumsum([0, *(1 + int(part.groups.max(initial=0)) for part in parts[:-1])])
    arrays["groups"] = (arrays["groups"] + np.repeat(firsts, counts)).astype(np.int32)
    arrays["bodies"] = np.repeat(np.arange(len(parts)), counts).astype(np.int32)
    return Faces(**arrays, prints=parts[0].prints)


def as_one_body(faces: Faces) -> Faces:
    """The same faces, all of body 0."""
    return replace(faces, bodies=np.zeros_like(faces.bodies))


def static_faces(world: World) -> Faces:
    """Floor, everything that never moves, markers and posters, in the world's frame."""
    solids = [_solid_faces(solid, _footprint(solid), solid.z_span) for solid in standing_solids(world) if solid.mass == 0.0]
    hung = _hung(world)
    whole = joined([_floor(world), *solids, *(_print_face(corners, cells, k) for k, (corners, cells) in enumerate(hung))])
    return replace(as_one_body(whole), prints=tuple(cells for _, cells in hung))


def body_faces(solid: Solid) -> Faces:
    """One solid in its own frame: origin in its middle, axes along its sides."""
    x, y, z, yaw = middle(solid)
    low, high = solid.z_span
    return _solid_faces(solid, SE2(x, y, yaw).inverse().transform(_footprint(solid)), (low - z, high - z))


def mesh_faces(meshes: Sequence[tuple[FloatArray, Colour]], material: str) -> Faces:
    """A body of smooth pieces in its own frame: triangles (M, 3, 3), counter-clockwise from outside, and colour of each."""
    pieces = [_faces(triangles[:, [0, 1, 2, 2]], (colour, "plain", material), smooth=len(triangles)) for triangles, colour in meshes]
    return as_one_body(joined(pieces))


def prism_faces(footprint: FloatArray, z_span: tuple[float, float], look: tuple[Colour, str, str]) -> Faces:
    """An upright prism over a convex footprint (N, 2), counter-clockwise; `look` is colour, texture and material."""
    low, high = (np.column_stack([footprint, np.full(len(footprint), z)]) for z in z_span)
    sides = np.stack([low, np.roll(low, -1, 0), np.roll(high, -1, 0), high], axis=1)
    return _faces(np.concatenate([sides, _cap(high), _cap(low[::-1])]), look, smooth=len(sides) if len(sides) > 4 else 0)


def _solid_faces(solid: Solid, footprint: FloatArray, z_span: tuple[float, float]) -> Faces:
    if isinstance(solid, Wall):
        colour, texture = COLOURS[solid.texture], str(solid.texture)
    else:
        colour, texture = FURNITURE[zlib.crc32(solid.name.encode()) % len(FURNITURE)], "grain"
    return prism_faces(footprint, z_span, (MATERIAL_COLOURS.get(solid.material, colour), texture, solid.material))


def _footprint(solid: Solid) -> FloatArray:
    """Corners (N, 2) [m], counter-clockwise."""
    if not isinstance(solid, Cylinder):
        return solid.footprint()
    sides = math.ceil(math.pi / math.acos(1.0 - min(FLATNESS / solid.radius, 0.1)))
    angles = np.arange(sides) * (math.tau / sides)
    return np.array(solid.centre) + solid.radius * np.column_stack([np.cos(angles), np.sin(angles)])


def _floor(world: World) -> Faces:
    x0, y0, x1, y1 = np.array(world.bounds) + np.array([-1, -1, 1, 1]) * FLOOR_MARGIN
    corners = np.array([[[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]]])
    return _faces(corners, (COLOURS[world.floor], world.floor, "matte"))


def _hung(world: World) -> list[tuple[FloatArray, Cells]]:
    """Corners and cells of every marker's print, then of every poster, then of every board."""
    marker_cells = [(marker, marker_print(world.dictionary, marker.id)) for marker in world.markers]
    posters = [(poster.corners(), poster_print(poster.seed)) for poster in world.posters]
    boards = [(board.corners(), board_print(board)) for board in world.boards]
    return [*((_grown(marker.corners(), len(cells)), cells) for marker, cells in marker_cells), *posters, *boards]


def _print_face(corners: FloatArray, cells: Cells, number: int) -> Faces:
    """A print whose top left, top right, bottom right and bottom left corners (4, 3) are given."""
    top_left, right, down = corners[0], corners[1] - corners[0], corners[3] - corners[0]
    axes = np.array([right / (right @ right) * cells.shape[1], down / (down @ down) * cells.shape[0]])
    face = _faces(corners[None, [0, 3, 2, 1]], ((255, 255, 255), "plain", "matte"))
    face.mappings[0] = np.column_stack([axes, -axes @ top_left])
    face.textures[0] = -1 - number
    return face


def _grown(corners: FloatArray, cells: int) -> FloatArray:
    """Corners (4, 3) of a marker's whole print, margin and all, from those of its black square."""
    middle_of_print = corners.mean(axis=0)
    return middle_of_print + (corners - middle_of_print) * (cells / (cells - 2 * MARGIN))


def _faces(corners: FloatArray, look: tuple[Colour, str, str], smooth: int = 0) -> Faces:
    """Faces (F, 4, 3) of one look; the first `smooth` of them are one surface."""
    count, (colour, texture, material) = len(corners), look
    groups = np.concatenate([np.zeros(smooth), 1 + np.arange(count - smooth)])
    return Faces(
        corners=np.ascontiguousarray(corners, dtype=np.float64),
        colours=np.tile(np.array(colour, np.float32), (count, 1)),
        textures=np.full(count, TEXTURES.index(texture), np.int32),
        mappings=_mappings(corners, smooth),
        groups=groups.astype(np.int32),
        materials=np.full(count, MATERIALS.index(material), np.int32),
        bodies=np.zeros(count, np.int32),
    )


def _mappings(corners: FloatArray, around: int) -> FloatArray:
    """Along a wall and up, or along x and y; the first `around` faces go on where the one before ended."""
    normals = _normals(corners)
    upright = np.abs(normals[:, 2]) < 0.7
    mappings = np.zeros((len(corners), 2, 4))
    mappings[~upright, [[0]], [[0]]] = 1.0
    mappings[~upright, [[1]], [[1]]] = 1.0
    tangents = np.column_stack([-normals[:, 1], normals[:, 0], np.zeros(len(normals))])[upright]
    mappings[upright, 0, :3] = tangents / np.linalg.norm(tangents, axis=1)[:, None]
    mappings[upright, 1, 2] = 1.0
    sides = np.linalg.norm(corners[:around, 1] - corners[:around, 0], axis=1)
    mappings[:around, 0, 3] = np.cumsum(sides) - 0.5 * sides
    return mappings


def _normals(corners: FloatArray) -> FloatArray:
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return normals / np.linalg.norm(normals, axis=1)[:, None]


def _cap(ring: FloatArray) -> FloatArray:
    """Faces (F, 4, 3) that fill a convex ring of corners (N, 3)."""
    if len(ring) == 4:
        return ring[None]
    fan = np.stack([np.repeat(ring[:1], len(ring) - 2, 0), ring[1:-1], ring[2:]], axis=1)
    return fan[:, [0, 1, 2, 2]]
