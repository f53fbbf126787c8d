"""Families of markers: an OpenCV dictionary, and the sizes in which its markers were printed."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import cv2

from slam.errors import ParameterError, require_not_negative, require_positive


@dataclass(frozen=True, slots=True)
class MarkerFamily:
    """Markers of one dictionary."""

    dictionary: str = "DICT_ARUCO_MIP_36h12"
    """OpenCV's name, or the path of a dictionary that OpenCV's calibration tools wrote."""
    size: float = 0.12
    """Side of the black square [m]."""
    sizes: dict[str, float] = field(default_factory=dict[str, float])
    """Of those ids that differ [m]."""
    first: int = 0
    """Added to this dictionary's ids, so that several dictionaries do not mix theirs."""

    def __post_init__(self) -> None:
        require_positive(self, "size")
        require_not_negative(self, "first")
        if not all(name.isdecimal() and size > 0.0 for name, size in self.sizes.items()):
            raise ParameterError(self, "sizes", "ids with sizes above 0")

    def size_of(self, marker: int) -> float:
        """Side [m] of a marker of this dictionary."""
        return self.sizes.get(str(marker), self.size)

    def load(self) -> cv2.aruco.Dictionary:
        """OpenCV's dictionary.

        Raises:
            ParameterError: there is none of this name.
        """
        name = self.dictionary if self.dictionary.startswith("DICT_") else f"DICT_{self.dictionary}"
        if hasattr(cv2.aruco, name):
            return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
        dictionary = cv2.aruco.Dictionary()
        if Path(self.dictionary).is_file():
            storage = cv2.FileStorage(self.dictionary, cv2.FILE_STORAGE_READ)
            if dictionary.readDictionary(storage.root()):
                return dictionary
        raise ParameterError(self, "dictionary", "a name such as DICT_ARUCO_MIP_36h12, DICT_4X4_50, DICT_APRILTAG_36h11, or a file")
