"""The source report's marker map, step by step: the named baseline `chain`.

The first marker's frame is the world. A frame that sees a known marker `ref` and a new one `id` sets
T_world_id = T_world_ref T_cam_ref^-1 T_cam_id, and the camera is where the known marker nearest to it says. Errors add up from marker
to marker and nothing ever takes them off again; of IPPE's two poses the first is believed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from slam.landmarks.marker_map import MappedMarker, MarkerMap
from slam.landmarks.sighting import Sighting
from slam.se3 import SE3


@dataclass(slots=True, eq=False)
class MarkerChain:
    """`updateMap` of the report."""

    markers: dict[int, MappedMarker] = field(default_factory=dict[int, MappedMarker])

    def update(self, sightings: Sequence[Sighting]) -> SE3 | None:
        """Chain the new markers of a frame to a known one; returns `T_world_camera`, None where no known marker is seen."""
        if not self.markers and sightings:
            first = max(sightings, key=lambda s: s.side)
            self._set(first, SE3())
        known = [s for s in sightings if s.id in self.markers]
        if not known:
            return None
        ref = max(known, key=lambda s: s.side)
        T_world_camera = self.markers[ref.id].T_map_marker @ ref.branches[0].inverse()
        for sighting in sightings:
            if sighting.id not in self.markers:
                self._set(sighting, T_world_camera @ sighting.branches[0])
        return T_world_camera

    def map(self, dictionary: str) -> MarkerMap:
        """The map so far, in the first marker's frame."""
        return MarkerMap.of(self.markers.values(), dictionary)

    def _set(self, sighting: Sighting, T_world_marker: SE3) -> None:
        self.markers[sighting.id] = MappedMarker(sighting.id, sighting.size, T_world_marker, sightings=1)
