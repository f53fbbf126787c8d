"""Where markers are."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from slam.errors import SlamError
from slam.landmarks.sighting import square
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3

POINTLIKE = np.zeros((6, 6))


class MarkerMapError(SlamError):
    """A marker map that cannot be used."""


@dataclass(frozen=True, slots=True, eq=False)
class MappedMarker:
    """A marker with a place."""

    id: int
    size: float
    """Side of the black square [m]."""
    T_map_marker: SE3
    """x right, y up, z out of the print."""
    covariance: FloatArray = field(default_factory=lambda: POINTLIKE)
    """(6, 6) of the translation and the rotation vector, both in the map's axes [m, rad]; 0: true without doubt."""
    sightings: int = 0
    """That it was made from."""

    @property
    def corners(self) -> FloatArray:
        """(4, 3) in the map [m], in the order of `square`."""
        return self.T_map_marker.transform(square(self.size))


@dataclass(frozen=True, slots=True, eq=False)
class MarkerMap:
    """Markers by id, all of one dictionary."""

    markers: Mapping[int, MappedMarker]
    dictionary: str
    T_base_camera: SE3 | None = None
    """The camera's mount as it was found while mapping."""

    @classmethod
    def of(cls, markers: Iterable[MappedMarker], dictionary: str, T_base_camera: SE3 | None = None) -> MarkerMap:
        """A map of these markers.

        Raises:
            MarkerMapError: an id is there twice.
        """
        ordered = sorted(markers, key=lambda marker: marker.id)
        by_id = {marker.id: marker for marker in ordered}
        if len(by_id) < len(ordered):
            twice = next(a.id for a, b in pairwise(ordered) if a.id == b.id)
            raise MarkerMapError(f"marker {twice} is in the map twice; ids must differ")
        return cls(by_id, dictionary, T_base_camera)

    def require_dictionary(self, dictionaries: Iterable[str]) -> None:
        """Check that the map's markers are of one of these dictionaries.

        Raises:
            MarkerMapError: they are not.
        """
        wanted = [_bare(name) for name in dictionaries]
        if _bare(self.dictionary) not in wanted:
            raise MarkerMapError(f"the marker map is of dictionary {self.dictionary}, the markers looked for are of {', '.join(wanted)}")

    def moved(self, T_new_map: SE3) -> MarkerMap:
        """The same map in another frame."""
        Ad = np.kron(np.eye(2), T_new_map.R)
        markers = [
            MappedMarker(m.id, m.size, T_new_map @ m.T_map_marker, Ad @ m.covariance @ Ad.T, m.sightings) for m in self.markers.values()
        ]
        return MarkerMap.of(markers, self.dictionary, self.T_base_camera)

    def anchored(self, marker: int, T_map_marker: SE3) -> MarkerMap:
        """The same map in the frame in which this marker has this pose; `SE3()` makes it the frame itself.

        Raises:
            MarkerMapError: the marker is not in the map.
        """
        if marker not in self.markers:
            raise MarkerMapError(f"no marker {marker} in the map; there are {', '.join(map(str, self.markers)) or 'none'}")
        return self.moved(T_map_marker @ self.markers[marker].T_map_marker.inverse())

    def anchored_to_robot(self, T_map_base: SE2, T_new_base: SE2) -> MarkerMap:
        """The same map in the frame in which the robot's pose is `T_new_base` where it was `T_map_base`."""
        return self.moved(SE3.from_se2(T_new_base @ T_map_base.inverse()))


def _bare(dictionary: str) -> str:
    return dictionary.removeprefix("DICT_")
