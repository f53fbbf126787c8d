"""Correlative search by branch and bound: the best pose of a lattice without trying all of them.

After Hess, Kohler, Rapp, Andor, "Real-time loop closure in 2D LIDAR SLAM" (2016), algorithms 2 and 3. There a node of level h holds
2^h x 2^h shifts at one heading; here it holds a group of headings too, and neighbouring points have one representative, which is looked up
at the middle heading. No pose of the node takes a point farther than m = 2^h / 4 cells from where the representative falls, so the best
score in 2^h + 2 m cells to each side bounds what the point adds.
"""

from __future__ import annotations

import numpy as np

from slam.kernels.jit import njit
from slam.kernels.lattice import Floats, Integers, Lattice, Node, belongs, least_cost
from slam.kernels.look_ups import Problem, Tables, look_up, room_for
from slam.kernels.merging import make_clouds

Rules = tuple[float, float, tuple[int, int, int, int, int]]
"""Rating to be exceeded; rating over which the likelihood falls to 1 / e; heading and shift (row, col) of a mode that does not count, and
the headings and cells from there on that do."""
Pose = tuple[float, int, int, int]
"""Rated sum of scores, heading, shift (row, col)."""
NO_MODE = (0, 0, 0, 0, 0)
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
    problem = (tables, clouds, lattice, room_for(clouds, lattice))
    bounds, moments = rate_top(problem), np.zeros(10)
    best = explore(problem, bounds, (least, scale, NO_MODE), moments)
    rival = (0.0, -1, 0, 0)
    if best[1] >= 0 and share < 1.0:
        rules = (zero + share * (best[0] - zero), 0.0, (best[1], best[2], best[3], headings, cells))
        rival = explore(problem, bounds, rules, np.empty(0))
    return best, rival, moments


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
                        bounds[group, k, m] = sums[2 * (k - i) + m - j] - least_cost(node, groups, lattice)
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
            if bound <= least or belongs(node, groups, near):
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
                bound = sums[part] - least_cost(child, groups, lattice)
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
