"""A feature network in an ONNX file, run by OpenCV's own engine.

Its input is a grey picture (1, 1, H, W), or a colour one (1, 3, H, W), 0 to 1; where the file fixes H and W the picture is scaled. Its
outputs are known by their shapes, so that most published networks do as they are:

- dense: scores of every pixel in cells of 8 with a last channel for "none" (1, 65, H/8, W/8), as in DeTone, Malisiewicz, Rabinovich,
  "SuperPoint" (2018), or a heat map (1, 1, h, w); and descriptors (1, D, h', w');
- sparse: points (1, N, 2), column and row [px], scores (1, N), descriptors (1, N, D).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from slam.errors import SlamError
from slam.se2 import FloatArray

Floats32 = NDArray[np.float32]
CELL = 8
STRIDE = 8
"""Height and width of the input are multiples of it: what is over is cut off [px]."""
APART = 4
"""Points of a heat map are the largest within so many pixels."""
LEAST_SCORE = 1e-4


class FeatureNetworkError(SlamError):
    """A file that is no feature network, or outputs that are none of those known."""


@dataclass(frozen=True, slots=True, eq=False)
class FeatureNetwork:
    """A network with what its input has to be."""

    name: str
    net: cv2.dnn.Net
    channels: int

    @classmethod
    def read(cls, file: str) -> Self:
        """Read a network.

        Raises:
            FeatureNetworkError: the file is missing or OpenCV cannot read it.
        """
        if not Path(file).is_file():
            raise FeatureNetworkError(f"no feature network at '{file}'; give an ONNX file")
        try:
            net = cv2.dnn.readNetFromONNX(file)
        except cv2.error as error:
            raise FeatureNetworkError(f"{file} is no network that OpenCV can read: {_brief(error)}") from error
        for channels in (1, 3):
            network = cls(file, net, channels)
            try:
                network._forward(np.zeros((64, 64), np.uint8))
            except FeatureNetworkError:
                continue
            return network
        raise FeatureNetworkError(f"{file} takes neither a picture (1, 1, H, W) nor one of three channels (1, 3, H, W)")

    def run(self, grey: NDArray[np.uint8]) -> tuple[FloatArray, Floats32, FloatArray]:
        """Pixels (N, 2), descriptors (N, D) of length 1 and scores (N,) of a picture (H, W).

        Raises:
            FeatureNetworkError: the outputs are none of those known.
        """
        height, width = (side - side % STRIDE for side in grey.shape)
        outputs = self._forward(grey[:height, :width])
        points = next((o for o in outputs if o.ndim == 3 and o.shape[2] == 2), None)
        pixels, descriptors, scores = self._sparse(outputs, points) if points is not None else self._dense(outputs, (height, width))
        length = np.linalg.norm(descriptors, axis=1, keepdims=True)
        return pixels, np.asarray(descriptors / np.maximum(length, 1e-12), np.float32), scores

    def _forward(self, grey: NDArray[np.uint8]) -> list[Floats32]:
        plane = grey.astype(np.float32)[None, None] / np.float32(255.0)
        try:
            self.net.setInput(np.repeat(plane, self.channels, axis=1))
            return [np.asarray(o, np.float32) for o in self.net.forward(self.net.getUnconnectedOutLayersNames())]
        except cv2.error as error:
            raise FeatureNetworkError(
                f"{self.name} does not run on a picture of {grey.shape[1]} x {grey.shape[0]}: {_brief(error)}"
            ) from error

    def _sparse(self, outputs: list[Floats32], points: Floats32) -> tuple[FloatArray, Floats32, FloatArray]:
        count = points.shape[1]
        scores = next((o.reshape(-1) for o in outputs if o.size == count), None)
        descriptors = next((o[0] for o in outputs if o.ndim == 3 and o.shape[1] == count and o.shape[2] > 2), None)
        if scores is None or descriptors is None:
            raise self._unknown(outputs)
        return points[0].astype(np.float64), descriptors, scores.astype(np.float64)

    def _dense(self, outputs: list[Floats32], size: tuple[int, int]) -> tuple[FloatArray, Floats32, FloatArray]:
        maps = [o[0] for o in outputs if o.ndim == 4]
        heat = next((o for o in maps if len(o) in (1, CELL * CELL + 1)), None)
        descriptors = next((o for o in maps if o is not heat and len(o) > 1), None)
        if heat is None or descriptors is None:
            raise self._unknown(outputs)
        scores = _unfolded(heat) if len(heat) > 1 else heat[0]
        if scores.shape != size:
            scores = np.asarray(cv2.resize(scores, size[::-1], interpolation=cv2.INTER_LINEAR), np.float32)
        rows, columns = _peaks(scores)
        return (
            np.column_stack([columns, rows]).astype(np.float64),
            _sampled(descriptors, rows, columns, size),
            scores[rows, columns].astype(np.float64),
        )

    def _unknown(self, outputs: list[Floats32]) -> FeatureNetworkError:
        shapes = ", ".join(str(o.shape) for o in outputs)
        return FeatureNetworkError(
            f"{self.name} answers with {shapes}; known are scores and descriptors, dense (1, 65 or 1, h, w), (1, D, h, w) or sparse"
        )


def _unfolded(cells: Floats32) -> Floats32:
    """Scores (H, W) of logits (65, H/8, W/8): softmax over a cell's pixels and "none"."""
    raised = np.exp(cells - cells.max(axis=0))
    share = (raised / raised.sum(axis=0))[:-1]
    _, h, w = share.shape
    return np.ascontiguousarray(share.reshape(CELL, CELL, h, w).transpose(2, 0, 3, 1).reshape(h * CELL, w * CELL), np.float32)


def _peaks(scores: Floats32) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows and columns of local maxima."""
    around = cv2.dilate(scores, np.ones((2 * APART + 1, 2 * APART + 1), np.uint8))
    rows, columns = np.nonzero((scores == around) & (scores > LEAST_SCORE))
    return rows.astype(np.int64), columns.astype(np.int64)


def _sampled(maps: Floats32, rows: NDArray[np.int64], columns: NDArray[np.int64], size: tuple[int, int]) -> Floats32:
    """Descriptors (N, D) at pixels, between the cells of maps (D, h, w) bilinearly."""
    _, h, w = maps.shape
    y = np.clip((rows + 0.5) * h / size[0] - 0.5, 0.0, h - 1.0)
    x = np.clip((columns + 0.5) * w / size[1] - 0.5, 0.0, w - 1.0)
    i, j = np.minimum(y.astype(np.int64), max(h - 2, 0)), np.minimum(x.astype(np.int64), max(w - 2, 0))
    a, b = (y - i).astype(np.float32), (x - j).astype(np.float32)
    i1, j1 = np.minimum(i + 1, h - 1), np.minimum(j + 1, w - 1)
    top = maps[:, i, j] * (1 - b) + maps[:, i, j1] * b
    low = maps[:, i1, j] * (1 - b) + maps[:, i1, j1] * b
    return np.asarray((top * (1 - a) + low * a).T, np.float32)


def _brief(error: cv2.error) -> str:
    return str(error).strip().splitlines()[0][:200]
