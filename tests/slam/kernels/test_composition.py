import numpy as np
import pytest

from slam.kernels import composition

RESOLUTION, SCALE = 0.05, 0.04


@pytest.mark.parametrize("pose", [(0.0, 0.0, 0.0), (0.31, -0.22, 0.6), (1.2, 0.4, np.pi / 2), (0.9, 0.7, -2.3), (-9.0, 0.0, 0.0)])
def test_every_cell_takes_what_the_source_has_at_its_centre(pose: tuple[float, float, float]) -> None:
    source = np.random.default_rng(3).integers(-125, 1, (17, 23)).astype(np.int8)
    target = np.zeros((31, 29), np.float32)
    composition.gather(target, source, np.array(pose), RESOLUTION, SCALE)
    c, s = np.cos(pose[2]), np.sin(pose[2])
    for row, col in np.ndindex(target.shape):
        dx, dy = (col + 0.5) * RESOLUTION - pose[0], (row + 0.5) * RESOLUTION - pose[1]
        j, i = np.floor((c * dx + s * dy) / RESOLUTION), np.floor((c * dy - s * dx) / RESOLUTION)
        there = 0 <= i < 17 and 0 <= j < 23
        assert target[row, col] == pytest.approx(source[int(i), int(j)] * SCALE if there else 0.0, abs=1e-5)
