"""`bricktwin/ExploreVision-v0`: as `Explore-v0`, with the camera's image in the observation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from sim.envs.body import Body
from sim.envs.explore import ExploreEnv, Observation, observation_space
from sim.envs.hal_body import HalBody

WIDTH, HEIGHT = 84, 84
"""Of the image [px]."""


class ExploreVisionEnv(ExploreEnv):
    """One robot with a camera; options are those of `sim.envs.task.Task`."""

    def __init__(self, render_mode: str | None = None, operator: Callable[[str], object] = input, **options: Any) -> None:  # noqa: ANN401 (as `Task` has them)
        """See `ExploreEnv`; there is no kernel with a camera.

        Raises:
            SimError: the robot has no camera.
        """
        super().__init__(render_mode, operator, **{**options, "native": False})
        self.observation_space = spaces.Dict({**observation_space().spaces, "image": spaces.Box(0, 255, (3, HEIGHT, WIDTH), np.uint8)})

    def _make_body(self, operator: Callable[[str], object]) -> Body:
        self._seeing = HalBody(self.task, operator, camera=True)
        return self._seeing

    def observe(self) -> Observation:
        """See `ExploreEnv.observe`; the image is black before the first one has come."""
        return {**super().observe(), "image": _small(self._seeing.image)}


def _small(image: NDArray[np.uint8] | None) -> NDArray[np.uint8]:
    """A colour image (H, W, 3) as (3, HEIGHT, WIDTH)."""
    if image is None:
        return np.zeros((3, HEIGHT, WIDTH), np.uint8)
    small = cv2.resize(image, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(small.transpose(2, 0, 1), dtype=np.uint8)
