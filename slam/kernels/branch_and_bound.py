"""Correlative search by branch and bound: the best pose of a lattice without trying all of them.

After Hess, Kohler, Rapp, Andor, "Real-time loop closure in 2D LIDAR SLAM" (2016), algorithms 2 and 3. There a node of level h holds
2^h x 2^h shifts at one heading; here it holds a group of headings too, and neighbouring points have one representative, which is looked up
at the middle heading. No pose of the node takes a point farther than m = 2^h / 4 cells from where the representative falls, so the best
score in 2^h + 2 m cells to each side bounds what the point adds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.merging import Clouds, make_clouds
from slam.kernels.score_tables import Scores

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Tables = tuple[Scores, int]
"""Score tables (L + 1, H, W), the first of the cells, table h of the best in 2^h + 2 m cells to each side; score off the tables."""
Lattice = tuple[Floats, float, int, int, float, float]
"""Centre x, y [cells], yaw; heading step [rad]; cells and headings to each side; costs of a squared cell and of a squared heading."""
Node = tuple[int, int, int, int]
"""Level, group of headings, shift (row, col) of the lower left pose."""
Work = tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32], Integers, Integers, NDArray[np.bool_]]
"""Rows, columns and flat cells of the points of every level and group; where each level begins; lowest and highest row and column
(L + 1, T, 4); which groups are turned already."""
Problem = tuple[Tables, Clouds, Lattice, Work]
Rules = tuple[float, float, tuple[int, int, int, int, int]]
"""Rating to be exceeded; rating over which the likelihood falls to 1 / e; heading and shift (row, col) of a mode that does not count, and
the headings and cells from there on that do."""
Pose = tuple[float, int, int, int]
"""Rated sum of scores, heading, shift (row, col)."""
NO_MODE = (0, 0, 0, 0, 0)
FIRST_MERGED = 2
"""Level below which a cell has no room for merging points: m is 0."""
LEAST_LIKELY = np.log(1e-2)
"""Poses less likely than this, the best being 0, have no weight."""
MOST_POSES = 20_000
"""Poses that are weighed; a scan that fits more of them says next to nothing."""


@njit
def find(
    tables: Tables, points: Floats, lattice: Lattice, zero: float, limits: tuple[float, float, float, int, int]
) -> tuple[Pose, Pose, Floats]:
    """The lattice's best pose, heading -1 where there is none, the best of another mode likewise, and the moments of `explore` about it.

    Args:
        tables: of the map.
        points: (N, 2) [cells] in base, one for each cell.
        lattice: of poses.
        zero: rating at which a pose is worth nothing.
        limits: rating to be exceeded; rating over which the likelihood falls to 1 / e; share of the best rating that another mode must
            exceed; headings and cells from where on it is another.
    """
    least, scale, share, headings, cells = limits
    clouds = make_clouds(points, len(tables[0]) - 1, lattice[1])
    problem = (tables, clouds, lattice, _room(clouds, lattice))
    bounds, moments = rate_top(problem), np.zeros(10)
    best = explore(problem, bounds, (least, scale, NO_MODE), moments)
    rival = (0.0, -1, 0, 0)
    if best[1] >= 0 and share < 1.0:
        rules = (zero + share * (best[0] - zero), 0.0, (best[1], best[2], best[3], headings, cells))
        rival = explore(problem, bounds, rules, np.empty(0))
    return best, rival, moments


@njit
def look_up(problem: Problem, node: Node, apart: int, sums: Integers) -> None:
    """Write the sums (4,) of the bounds of four nodes: one, and those `apart` cells to its right, above it, and both."""
    (levels, _), (_, beams, begins, _), _, work = problem
    level, group, row, col = node
    if not work[5][level, group]:
        _turn(problem, level, group)
    first, last = begins[level], begins[level + 1]
    start = work[3][level] + group * (last - first)
    scores, end = levels[level], start + last - first
    height, width = scores.shape
    row, col = row - (1 << level) // 4, col - (1 << level) // 4
    low_row, high_row, low_col, high_col = work[4][level, group]
    if low_row + row < 0 or low_col + col < 0 or high_row + row + apart >= height or high_col + col + apart >= width:
        _add_clamped((work[0][start:end], work[1][start:end], beams[first:last]), scores, (row, col, apart), sums)
    elif level < FIRST_MERGED:
        _add(work[2][start:end], scores, (row * width + col, apart), sums)
    else:
        _add_weighed(work[2][start:end], beams[first:last], scores, (row * width + col, apart), sums)


@njit
def _add(places: NDArray[np.int32], scores: Scores, at: tuple[int, int], sums: Integers) -> None:
    """`look_up` of points at flat cells (N,), each of one beam: more than twice as fast as the weighed one."""
    flat, shift = scores.reshape(-1), at[0]
    right, up = np.uint64(at[1]), np.uint64(at[1] * scores.shape[1])
    a, b, c, d = 0, 0, 0, 0
    for i in range(len(places)):
        place = np.uint64(places[i] + shift)
        a += flat[place]
        b += flat[place + right]
        c += flat[place + up]
        d += flat[place + up + right]
    sums[0], sums[1], sums[2], sums[3] = a, b, c, d


@njit
def _add_weighed(places: NDArray[np.int32], beams: Integers, scores: Scores, at: tuple[int, int], sums: Integers) -> None:
    """`look_up` of points at flat cells (N,)."""
    flat, shift = scores.reshape(-1), at[0]
    right, up = np.uint64(at[1]), np.uint64(at[1] * scores.shape[1])
    a, b, c, d = 0, 0, 0, 0
    for i in range(len(places)):
        place, n = np.uint64(places[i] + shift), beams[i]
        a += n * flat[place]
        b += n * flat[place + right]
        c += n * flat[place + up]
        d += n * flat[place + up + right]
    sums[0], sums[1], sums[2], sums[3] = a, b, c, d


@njit
def _add_clamped(
    cells: tuple[NDArray[np.int32], NDArray[np.int32], Integers], scores: Scores, at: tuple[int, int, int], sums: Integers
) -> None:
    """`look_up` where some points fall off the table: they have the score of its border."""
    rows, cols, beams = cells
    height, width = scores.shape
    flat = scores.reshape(-1)
    row, col, apart = at
    a, b, c, d = 0, 0, 0, 0
    for i in range(len(rows)):
        y, x, n = rows[i] + row, cols[i] + col, beams[i]
        low, high = min(max(y, 0), height - 1) * width, min(max(y + apart, 0), height - 1) * width
        left, right = min(max(x, 0), width - 1), min(max(x + apart, 0), width - 1)
        a += n * flat[np.uint64(low + left)]
        b += n * flat[np.uint64(low + right)]
        c += n * flat[np.uint64(high + left)]
        d += n * flat[np.uint64(high + right)]
    sums[0], sums[1], sums[2], sums[3] = a, b, c, d


@njit
def _turn(problem: Problem, level: int, group: int) -> None:
    """Write the cells of a level's points at the middle heading of a group of headings, the centre's shift."""
    (levels, _), (points, _, begins, groups), (centre, step, _, turns, _, _), (rows, cols, places, room, extents, done) = problem
    yaw = centre[2] + (group * groups[level] + 0.5 * (groups[level] - 1) - turns) * step
    c, s = np.cos(yaw), np.sin(yaw)
    first, last = begins[level], begins[level + 1]
    start = room[level] + group * (last - first)
    low_row, high_row, low_col, high_col = np.int64(1 << 40), np.int64(-1 << 40), np.int64(1 << 40), np.int64(-1 << 40)
    for i in range(last - first):
        x, y = points[first + i, 0], points[first + i, 1]
        col, row = int(np.floor(centre[0] + c * x - s * y)), int(np.floor(centre[1] + s * x + c * y))
        rows[start + i], cols[start + i], places[start + i] = row, col, row * levels.shape[2] + col
        low_row, high_row = min(low_row, row), max(high_row, row)
        low_col, high_col = min(low_col, col), max(high_col, col)
    extent = extents[level, group]
    extent[0], extent[1], extent[2], extent[3] = low_row, high_row, low_col, high_col
    done[level, group] = True


@njit
def _room(clouds: Clouds, lattice: Lattice) -> Work:
    """Room for the cells of all levels and groups of headings."""
    begins, groups = clouds[2], clouds[3]
    headings = 2 * lattice[3] + 1
    room = np.zeros(len(groups) + 1, np.int64)
    room[1:] = np.cumsum((headings + groups - 1) // groups * (begins[1:] - begins[:-1]))
    rows, cols, places = np.empty(room[-1], np.int32), np.empty(room[-1], np.int32), np.empty(room[-1], np.int32)
    return rows, cols, places, room, np.empty((len(groups), headings, 4), np.int64), np.zeros((len(groups), headings), np.bool_)


@njit
def rate_top(problem: Problem) -> Floats:
    """Bounds (G, B, B) of the top level's nodes: groups of headings, rows, columns."""
    groups, lattice = problem[1][3], problem[2]
    reach, top = lattice[2], len(groups) - 1
    size, sums = 1 << top, np.empty(4, np.int64)
    n = (2 * reach + size) // size
    bounds = np.empty(((2 * lattice[3] + groups[top]) // groups[top], n, n))
    for group in range(len(bounds)):
        for i in range(0, n, 2):
            for j in range(0, n, 2):
                look_up(problem, (top, group, i * size - reach, j * size - reach), size, sums)
                for k in range(i, min(i + 2, n)):
                    for m in range(j, min(j + 2, n)):
                        node = (top, group, k * size - reach, m * size - reach)
                        bounds[group, k, m] = sums[2 * (k - i) + m - j] - _cost(node, groups, lattice)
    return bounds


@njit
def explore(problem: Problem, top_bounds: Floats, rules: Rules, moments: Floats) -> Pose:
    """Best pose with a rating above a least one, heading -1 where there is none: best first at the top, depth first below.

    The rating is the sum of the points' scores less the cost of the distance from the centre. With a scale in the rules all poses that
    are likely beside the best are weighed, but for more than `MOST_POSES`.

    Args:
        problem: what is searched for, and in what.
        top_bounds: of `rate_top`.
        rules: what counts.
        moments: (10,) written where there is a scale: sums of 1, x, y, yaw, x^2, x y, x yaw, y^2, y yaw, yaw^2 [steps from the centre],
            weighed with the likelihood.
    """
    groups, lattice, reach = problem[1][3], problem[2], problem[2][2]
    least, scale, near = rules
    top = len(groups) - 1
    size, n = 1 << top, top_bounds.shape[1]
    nodes, bounds, sums = np.empty((8 * top + 8, 4), np.int64), np.empty(8 * top + 8), np.empty(4, np.int64)
    best, reference, poses = (least, -1, 0, 0), least, 0
    rated = top_bounds.reshape(-1)
    places = np.flatnonzero(rated > least)
    places = places[np.argsort(-rated[places], kind="mergesort")]
    for place in places:
        if rated[place] <= least:
            break
        nodes[0, 0], nodes[0, 1] = top, place // (n * n)
        nodes[0, 2], nodes[0, 3] = place // n % n * size - reach, place % n * size - reach
        bounds[0] = rated[place]
        depth = 1
        while depth > 0:
            depth -= 1
            node, bound = (nodes[depth, 0], nodes[depth, 1], nodes[depth, 2], nodes[depth, 3]), bounds[depth]
            if bound <= least or _belongs(node, groups, near):
                continue
            if node[0] == 0:
                if bound > best[0]:
                    best = (bound, node[1], node[2], node[3])
                if scale > 0.0 and (poses == 0 or best[0] > reference - scale * LEAST_LIKELY):
                    moments[:] = 0.0  # what was weighed so far has no weight any more
                    reference, poses = best[0], 0
                if scale > 0.0 and poses < MOST_POSES:
                    poses += 1
                    _weigh(moments, np.exp((bound - reference) / scale), (node[3], node[2], node[1] - lattice[3]))
                least = max(least, best[0] + (scale * LEAST_LIKELY if poses < MOST_POSES else 0.0))
                continue
            depth = _branch(problem, node, (nodes, bounds, sums), (depth, least))
    return best


@njit
def _branch(problem: Problem, node: Node, stack: tuple[Integers, Floats, Integers], state: tuple[int, float]) -> int:
    """Put those children of a node on the stack that may exceed the least rating; returns the new depth."""
    groups, lattice = problem[1][3], problem[2]
    nodes, bounds, sums = stack
    base, least = state
    depth, below, apart, reach = base, node[0] - 1, 1 << (node[0] - 1), lattice[2]
    ratio, count = groups[node[0]] // groups[below], (2 * lattice[3] + groups[below]) // groups[below]
    for group in range(node[1] * ratio, min((node[1] + 1) * ratio, count)):
        look_up(problem, (below, group, node[2], node[3]), apart, sums)
        for part in range(4):
            child = (below, group, node[2] + apart * (part // 2), node[3] + apart * (part % 2))
            if child[2] <= reach and child[3] <= reach:
                bound = sums[part] - _cost(child, groups, lattice)
                if bound > least:
                    depth = _push(nodes, bounds, (base, depth), child, bound)
    return depth


@njit
def _weigh(moments: Floats, weight: float, pose: tuple[int, int, int]) -> None:
    """Add a pose to the moments of `explore`."""
    moments[0] += weight
    k = 4
    for i in range(3):
        moments[1 + i] += weight * pose[i]
        for j in range(i, 3):
            moments[k] += weight * pose[i] * pose[j]
            k += 1


@njit
def _push(nodes: Integers, bounds: Floats, stack: tuple[int, int], node: Node, bound: float) -> int:
    """Put a node on the stack (base, depth), the best of its siblings above the base on top; returns the new depth."""
    base, at = stack
    while at > base and bounds[at - 1] > bound:
        bounds[at], nodes[at] = bounds[at - 1], nodes[at - 1]
        at -= 1
    bounds[at] = bound
    nodes[at, 0], nodes[at, 1], nodes[at, 2], nodes[at, 3] = node
    return stack[1] + 1


@njit
def cost_at(pose: tuple[int, int, int], lattice: Lattice) -> float:
    """Cost of the distance of one pose, heading and shift (row, col), from the centre."""
    turn, row, col = pose
    return lattice[4] * (row * row + col * col) + lattice[5] * (turn - lattice[3]) ** 2


@njit
def _cost(node: Node, groups: Integers, lattice: Lattice) -> float:
    """Least cost of the distance from the centre in a node: level, group of headings, shift (row, col)."""
    size, headings = 1 << node[0], groups[node[0]]
    row, col = _nearest(node[2], size), _nearest(node[3], size)
    turn = _nearest(node[1] * headings - lattice[3], headings)
    return lattice[4] * (row * row + col * col) + lattice[5] * turn * turn


@njit
def _nearest(first: int, size: int) -> int:
    """The smallest distance from 0 of `first`..`first + size - 1`."""
    return max(first, 0, 1 - first - size)


@njit
def _farthest(first: int, size: int) -> int:
    """The largest distance from 0 of `first`..`first + size - 1`."""
    return max(abs(first), abs(first + size - 1))


@njit
def _belongs(node: Node, groups: Integers, mode: tuple[int, int, int, int, int]) -> bool:
    """Whether all poses of a node belong to the mode."""
    size, headings = 1 << node[0], groups[node[0]]
    if _farthest(node[1] * headings - mode[0], headings) >= mode[3]:
        return False
    row, col = _farthest(node[2] - mode[1], size), _farthest(node[3] - mode[2], size)
    return row * row + col * col < mode[4] * mode[4]
