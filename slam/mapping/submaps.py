"""The submaps and what ties them together: one pose graph whose nodes are the submaps' origins."""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np

from slam.mapping.pose_graph import PoseGraph
from slam.mapping.submap import Submap
from slam.mapping.uncertainty import composed, inverted
from slam.se2 import SE2, FloatArray

UNPACKED = 8
"""Submaps kept ready to be matched to."""


@dataclass(frozen=True, slots=True, eq=False)
class Closure:
    """What a closure rests on: a scan, and the kept scan of the other submap that is nearest to it."""

    stamp_i: float
    """Of the kept scan [s]."""
    stamp_j: float
    """Of the scan that was recognised [s]."""
    T_i_j: SE2


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """What was measured between the origins of two submaps."""

    i: int
    j: int
    T_i_j: SE2
    covariance: FloatArray
    """(3, 3), of the body j."""
    closure: bool
    seen: Closure | None = None
    """None of a link from an earlier session."""


class Submaps:
    """All submaps, by number."""

    def __init__(self) -> None:
        self.all: list[Submap] = []
        self.links: list[Link] = []
        self._graph = PoseGraph()
        self._recent: list[int] = []
        self._rejected: frozenset[int] = frozenset()
        self._chains: dict[int, list[FloatArray]] = {}

    def __len__(self) -> int:
        return len(self.all)

    def __getitem__(self, number: int) -> Submap:
        return self.all[number]

    def add(self, submap: Submap) -> None:
        """Take in the submap with the next number."""
        self.all.append(submap)
        self._chains.clear()
        self._graph.add_node(submap.T_map_submap)

    def tie(self, link: Link) -> None:
        """Take in a measurement."""
        self.links.append(link)
        self._chains.clear()
        information = np.linalg.inv(link.covariance)
        self._graph.add_edge(link.i, link.j, link.T_i_j, 0.5 * (information + information.T), link.closure)

    def settle(self) -> None:
        """Move all submaps to where all measurements together say; false closures are left out."""
        poses = self._graph.optimise()
        self._rejected = frozenset(self._graph.rejected)
        self._chains.clear()
        for submap, pose in zip(self.all, poses, strict=True):
            submap.T_map_submap = SE2.from_array(np.asarray(pose))

    def believed(self) -> list[Link]:
        """The links that the graph has not rejected."""
        return [link for number, link in enumerate(self.links) if number not in self._rejected]

    def tied(self, i: int, j: int) -> bool:
        """Whether two submaps have been measured against each other."""
        return any({link.i, link.j} == {i, j} for link in self.links)

    def use(self, number: int) -> Submap:
        """A submap that will be matched to; those that were used longest ago are packed."""
        self._recent = [number, *(other for other in self._recent if other != number)]
        for other in self._recent[UNPACKED:]:
            self.all[other].pack()
        del self._recent[UNPACKED:]
        return self.all[number]

    def relative(self, i: int) -> list[FloatArray]:
        """Body covariance (3, 3) of every `T_i_j`, along the surest chain of links from i; made once per change of the graph."""
        if i not in self._chains:
            self._chains[i] = self._surest_chains(i)
        return self._chains[i]

    def _surest_chains(self, i: int) -> list[FloatArray]:
        chains: list[FloatArray | None] = [None] * len(self.all)
        neighbours = self._neighbours()
        queue: list[tuple[float, int, int, FloatArray]] = [(0.0, 0, i, np.zeros((3, 3)))]
        tie_break = 0
        while queue:
            _, _, node, covariance = heapq.heappop(queue)
            if chains[node] is not None:
                continue
            chains[node] = covariance
            for other, T_node_other, step in neighbours[node]:
                if chains[other] is None:
                    grown, tie_break = composed(covariance, T_node_other, step), tie_break + 1
                    heapq.heappush(queue, (float(np.trace(grown)), tie_break, other, grown))
        unknown = np.diag([1e6, 1e6, 1e2])
        return [unknown if chain is None else chain for chain in chains]

    def _neighbours(self) -> list[list[tuple[int, SE2, FloatArray]]]:
        result: list[list[tuple[int, SE2, FloatArray]]] = [[] for _ in self.all]
        for link in self.believed():
            result[link.i].append((link.j, link.T_i_j, link.covariance))
            result[link.j].append((link.i, link.T_i_j.inverse(), inverted(link.covariance, link.T_i_j)))
        return result
