import numpy as np
import pytest

from slam.kernels import composition

RESOLUTION, SCALE = 0.05, 0.04


@pytest.mark.parametrize("pose", [(0.0, 0.0, 0.0), (0.31, -0.22, 0.6), (1.2, 0.4, np.pi / 2), (0.9, 0.7, -2.3), (-9.0, 0.0, 0.0)])
def test_every_cell_takes_the_free_space_that_the_source_has_at_its_centre(pose: tuple[float, float, float]) -> None:
    source = np.random.default_rng(3).integers(-125, 60, (17, 23)).astype(np.int8)
    target = np.zeros((31, 29), np.float32)
    composition.gather_free(target, source, np.array(pose), RESOLUTION, SCALE)
    c, s = np.cos(pose[2]), np.sin(pose[2])
    for row, col in np.ndindex(target.shape):
        dx, dy = (col + 0.5) * RESOLUTION - pose[0], (row + 0.5) * RESOLUTION - pose[1]
        j, i = np.floor((c * dx + s * dy) / RESOLUTION), np.floor((c * dy - s * dx) / RESOLUTION)
        there = 0 <= i < 17 and 0 <= j < 23
        assert target[row, col] == pytest.approx(min(source[int(i), int(j)], 0) * SCALE if there else 0.0, abs=1e-5)


def test_free_space_beside_a_wall_counts_little() -> None:
    steps = np.full((4, 5), -100, np.int8)
    steps[1, 2] = 80
    composition.raise_beside(steps, np.array([1 * 5 + 2], np.int32), -37)
    assert steps.tolist() == [[-100, -37, -37, -37, -100], [-100, -37, 80, -37, -100], [-100, -37, -37, -37, -100], [-100] * 5]
