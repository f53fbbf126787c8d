"""Pose graphs as g2o text files, planar ones: VERTEX_SE2 and EDGE_SE2."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from slam.errors import PoseGraphError
from slam.mapping.chordal import chordal_poses
from slam.mapping.pose_edges import Edges
from slam.se2 import FloatArray

COLUMNS = {
    "VERTEX_SE2": "id x y yaw",
    "EDGE_SE2": "i j x y yaw I11 I12 I13 I22 I23 I33",
}


@dataclass(frozen=True, slots=True, eq=False)
class G2oGraph:
    """N poses and E edges."""

    poses: FloatArray
    """(N, 3); of a file without vertices: found from the edges"""
    edges: Edges


def read_g2o(path: Path) -> G2oGraph:
    """Read a planar graph whose nodes are numbered from 0 on; lines that start with # are skipped.

    Raises:
        PoseGraphError: the file cannot be read, a line is not one of the two kinds, a number is not finite, an information matrix is
            not positive definite, vertices are missing, or the edges do not connect all nodes.
    """
    rows: dict[str, list[FloatArray]] = {kind: [] for kind in COLUMNS}
    for number, line in enumerate(_lines(path), 1):
        if line.strip() and not line.startswith("#"):
            kind, values = _parse(line, f"{path}, line {number}")
            rows[kind].append(values)
    edges = _edges(np.array(rows["EDGE_SE2"]).reshape(-1, 11), path)
    return G2oGraph(_poses(np.array(rows["VERTEX_SE2"]).reshape(-1, 4), edges, path), edges)


def _lines(path: Path) -> list[str]:
    try:
        return Path(path).read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise PoseGraphError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise PoseGraphError(f"{path}: is not text; it must be a g2o file of VERTEX_SE2 and EDGE_SE2") from error


def _parse(line: str, place: str) -> tuple[str, FloatArray]:
    kind, *words = line.split()
    if kind not in COLUMNS:
        raise PoseGraphError(f"{place}: '{kind[:40]}' must be one of {', '.join(COLUMNS)}")
    try:
        values = np.array(words, dtype=np.float64)
    except ValueError:
        values = np.empty(0)
    identifiers = values[: 1 if kind == "VERTEX_SE2" else 2]
    if len(values) != len(COLUMNS[kind].split()) or not np.all(np.isfinite(values)) or np.any((identifiers < 0) | (identifiers % 1 != 0)):
        raise PoseGraphError(f"{place}: '{line[:60]}' must be {kind} and finite numbers '{COLUMNS[kind]}'")
    return kind, values


def _edges(rows: FloatArray, path: Path) -> Edges:
    if len(rows) == 0:
        raise PoseGraphError(f"{path}: holds no edge; it must have lines 'EDGE_SE2 {COLUMNS['EDGE_SE2']}'")
    information = np.empty((len(rows), 3, 3))
    upper = np.triu_indices(3)
    information[:, upper[0], upper[1]] = information[:, upper[1], upper[0]] = rows[:, 5:]
    nodes = rows[:, :2].astype(np.int64)
    bad = (np.linalg.eigvalsh(information)[:, 0] <= 0.0) | (nodes[:, 0] == nodes[:, 1])
    if np.any(bad):
        i, j = nodes[np.argmax(bad)]
        raise PoseGraphError(f"{path}: edge {i} {j} must join two nodes with a positive definite information matrix")
    return Edges(nodes, np.ascontiguousarray(rows[:, 2:5]), information)


def _poses(rows: FloatArray, edges: Edges, path: Path) -> FloatArray:
    count = max(int(edges.nodes.max()) + 1, len(rows))
    i, j = edges.nodes.T
    pieces, _ = connected_components(coo_array((np.ones(len(edges)), (i, j)), shape=(count, count)), directed=False)
    if pieces != 1:
        raise PoseGraphError(f"{path}: falls into {pieces} pieces; edges must connect all nodes 0 to {count - 1}")
    if len(rows) == 0:
        return chordal_poses(count, edges)
    if not np.array_equal(np.sort(rows[:, 0]), np.arange(count)):
        raise PoseGraphError(f"{path}: {len(rows)} vertices; there must be one for each of the nodes 0 to {count - 1}, or none")
    return rows[np.argsort(rows[:, 0]), 1:].copy()
