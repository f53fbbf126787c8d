import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.kernels import insertion
from slam.kernels.surfaces import FLATNESS, NORMAL_X, ONE_SIDED, X, Y
from slam.se2 import FloatArray

SIZE = 8
HIT, MISS, LIMIT, NEAR = 0.5, -0.2, 5.0, 0.3


class Cells:
    """Eight by eight cells of one metre, with no known lines."""

    def __init__(self) -> None:
        self.log_odds = np.zeros((SIZE, SIZE), np.float32)
        self.count = np.zeros((SIZE, SIZE), np.float32)
        self.offset = np.zeros((SIZE, SIZE, 2), np.float32)
        self.facing = np.zeros((SIZE, SIZE, 2), np.float32)
        self.touched = np.zeros((SIZE, SIZE), np.uint8)
        self.nearest = np.full((SIZE, SIZE), -1, np.int32)
        self.surfaces = np.zeros((SIZE, SIZE, 5), np.float32)

    @property
    def arrays(self) -> insertion.Cells:
        return self.log_odds, self.count, self.offset, self.facing

    @property
    def field(self) -> tuple[np.ndarray, np.ndarray, float]:
        return self.nearest, self.surfaces, 1.0

    def know_wall(self, x: float, seen_from: float = 0.0) -> None:
        """A line at this x, in the cells of its column; seen from lower x (-1), higher x (+1) or both sides (0)."""
        normal, flatness = (seen_from, ONE_SIDED) if seen_from else (1.0, 1.0)
        for row in range(SIZE):
            self.nearest[row] = row * SIZE + int(x)
            self.surfaces[row, int(x)] = x, row + 0.5, normal, 0.0, flatness

    def hit(self, *points: tuple[float, float], start: tuple[float, float] = (0.5, 0.5)) -> tuple[np.ndarray, FloatArray]:
        origins = np.tile(start, (len(points), 1))
        return insertion.insert_hits(origins, np.array(points), self.field, self.arrays, self.touched, (HIT, LIMIT, NEAR))

    def miss(self, origins: FloatArray, points: FloatArray) -> np.ndarray:
        return insertion.insert_misses(origins, points, 1.0, (self.log_odds, self.count), self.touched, (MISS, LIMIT))

    def ray(self, *points: tuple[float, float], start: tuple[float, float] = (0.5, 0.5)) -> None:
        """A scan: hits, the free cells before them, and the marks cleared."""
        hits, ends = self.hit(*points, start=start)
        insertion.clear(self.touched, np.concatenate([hits, self.miss(np.tile(start, (len(points), 1)), ends)]))

    def absorb(self, *cells: tuple[int, int]) -> list[int]:
        flat = np.array([row * SIZE + col for row, col in cells])
        return insertion.absorb(self.arrays, self.field, flat, NEAR).tolist()

    def picture(self) -> list[str]:
        """Highest y on top: # occupied, . free, blank unknown."""
        return ["".join("#" if value > 0 else "." if value < 0 else " " for value in row).rstrip() for row in self.log_odds[::-1]]


def drawing(*rows: str) -> list[str]:
    return [""] * (SIZE - len(rows)) + list(rows)


def test_a_ray_along_a_row_frees_all_before_its_hit() -> None:
    cells = Cells()
    cells.ray((5.5, 0.5))
    assert cells.picture() == drawing(".....#")


def test_a_ray_along_a_diagonal_takes_one_side_of_every_corner() -> None:
    cells = Cells()
    cells.ray((3.5, 1.5))
    assert cells.picture() == drawing(" ..#", "..")


def test_a_ray_backwards_ends_in_its_hit() -> None:
    cells = Cells()
    cells.ray((0.5, 0.5), start=(5.5, 0.5))
    assert cells.picture() == drawing("#.....")


def test_a_fan_of_rays_draws_a_wall_and_the_room_before_it() -> None:
    cells = Cells()
    cells.ray((4.5, 0.5), (4.5, 1.5), (4.5, 2.5), (4.5, 3.5))
    assert cells.picture() == drawing("   .#", "  ..#", " ...#", "....#")


def test_a_ray_that_grazes_a_wall_does_not_erase_it() -> None:
    cells = Cells()
    cells.ray((3.5, 0.5), (6.5, 0.5))
    assert cells.picture() == drawing("...#..#")


def test_a_hit_in_its_own_first_cell_frees_nothing() -> None:
    cells = Cells()
    cells.ray((0.9, 0.9))
    assert cells.picture() == drawing("#")


def test_hits_and_rays_outside_the_grid_are_dropped() -> None:
    cells = Cells()
    cells.ray((11.5, 0.5), (0.5, -3.5), start=(-2.5, 0.5))
    assert cells.picture() == drawing("........")


def test_a_cell_counts_once_a_scan_however_often_it_is_hit() -> None:
    cells = Cells()
    hits, _ = cells.hit((3.1, 0.5), (3.9, 0.5), (3.5, 0.1))
    assert hits.tolist() == [3]
    assert cells.log_odds[0, 3] == np.float32(HIT)


def test_a_cell_counts_once_a_scan_however_often_it_is_crossed() -> None:
    cells = Cells()
    cells.ray((5.1, 0.5), (5.9, 0.5), (5.5, 0.1))
    assert cells.log_odds[0, 2] == np.float32(MISS)


def test_the_next_scan_counts_again() -> None:
    cells = Cells()
    for _ in range(2):
        cells.ray((5.5, 0.5))
    assert cells.log_odds[0, 5] == np.float32(2 * HIT)
    assert cells.log_odds[0, 2] == np.float32(2 * MISS)


def test_log_odds_stop_at_their_limits() -> None:
    cells = Cells()
    for _ in range(60):
        cells.ray((5.5, 0.5))
    assert cells.log_odds[0, 5] == LIMIT
    assert cells.log_odds[0, 2] == -LIMIT


def test_a_cell_keeps_the_mean_of_its_hits() -> None:
    cells = Cells()
    cells.hit((3.25, 0.5), (3.5, 0.75), (3.75, 0.25))
    np.testing.assert_allclose(cells.offset[0, 3], [0.0, 0.0], atol=1e-6)
    assert cells.count[0, 3] == 3.0


def test_the_oldest_hit_counts_as_much_as_the_newest() -> None:
    cells = Cells()
    for _ in range(300):
        cells.hit((3.2, 0.5))
    for _ in range(300):
        cells.hit((3.8, 0.5))
    assert cells.count[0, 3] == 600.0
    assert cells.offset[0, 3, 0] == pytest.approx(0.0, abs=1e-5)


def test_a_cell_that_turns_free_forgets_its_hits() -> None:
    cells = Cells()
    cells.ray((3.2, 0.5))
    for _ in range(5):
        cells.ray((6.5, 0.5))
    assert cells.count[0, 3] == 0.0
    cells.ray((3.8, 0.5))
    assert cells.offset[0, 3, 0] == pytest.approx(0.3, abs=1e-6)


@pytest.mark.parametrize("x", [3.8, 4.2])
def test_a_hit_near_a_line_counts_for_the_cell_of_the_line(x: float) -> None:
    cells = Cells()
    cells.know_wall(3.95)
    cells.hit((x, 2.5))
    assert np.argwhere(cells.log_odds > 0).tolist() == [[2, 3]]
    assert cells.offset[2, 3, 0] == pytest.approx(x - 3.5, abs=1e-6)


def test_a_hit_behind_its_line_does_not_free_the_wall_before_it() -> None:
    cells = Cells()
    cells.know_wall(3.95)
    cells.ray((4.2, 2.5), start=(0.5, 2.5))
    assert cells.picture()[-3] == "...#"


def test_a_slanted_ray_ends_where_it_meets_its_line_and_one_before_the_line_at_its_hit() -> None:
    cells = Cells()
    cells.know_wall(3.95)
    _, ends = cells.hit((4.2, 4.2), (3.8, 3.8))
    np.testing.assert_allclose(ends, [[3.95, 3.95], [3.8, 3.8]], atol=1e-6)


def test_a_hit_far_from_a_line_counts_for_its_own_cell() -> None:
    cells = Cells()
    cells.know_wall(3.95)
    cells.hit((4.4, 2.5))
    assert np.argwhere(cells.log_odds > 0).tolist() == [[2, 4]]


def test_a_hit_near_the_other_face_of_a_thin_wall_counts_for_its_own_cell() -> None:
    cells = Cells()
    cells.know_wall(3.95, seen_from=-1.0)
    cells.hit((4.2, 2.5), start=(7.5, 2.5))
    assert np.argwhere(cells.log_odds > 0).tolist() == [[2, 4]]


def test_a_hit_near_both_faces_of_a_thin_wall_counts_for_the_one_that_it_saw() -> None:
    cells = Cells()
    cells.know_wall(3.95, seen_from=-1.0)
    cells.nearest[2, 4], cells.surfaces[2, 4] = 2 * SIZE + 4, (4.15, 2.5, 1.0, 0.0, ONE_SIDED)
    cells.hit((3.99, 2.5), start=(7.5, 2.5))
    assert np.argwhere(cells.log_odds > 0).tolist() == [[2, 4]]


def test_a_cell_keeps_the_mean_direction_from_which_it_was_seen() -> None:
    cells = Cells()
    cells.hit((3.5, 0.5))
    cells.hit((3.5, 0.5), start=(3.5, 6.5))
    np.testing.assert_allclose(cells.facing[0, 3], [-0.5, 0.5], atol=1e-6)


def test_hits_behind_a_wall_move_into_it() -> None:
    cells = Cells()
    cells.hit((3.9, 2.5), (3.9, 2.5), (3.9, 2.5), (4.1, 2.5))
    cells.know_wall(3.95)
    assert cells.absorb((2, 3), (2, 4)) == [2 * SIZE + 4]
    assert cells.log_odds[2, 4] == 0.0
    assert (cells.count[2, 3], cells.count[2, 4]) == (4.0, 0.0)
    assert cells.offset[2, 3, 0] == pytest.approx((3 * 3.9 + 4.1) / 4 - 3.5, abs=1e-6)


def test_hits_far_behind_a_wall_stay() -> None:
    cells = Cells()
    cells.hit((3.9, 2.5), (3.9, 2.5), (4.4, 2.5))
    cells.know_wall(3.95)
    assert cells.absorb((2, 3), (2, 4)) == []


def test_the_lesser_cell_moves_into_the_greater_and_not_back() -> None:
    cells = Cells()
    cells.hit((3.9, 2.5), (4.1, 2.5), (4.1, 2.5))
    cells.know_wall(3.95)
    assert cells.absorb((2, 3), (2, 4)) == []


def overlap(start: FloatArray, end: FloatArray, cell: tuple[int, int], margin: float) -> float:
    """Share of the segment inside a cell that is larger by a margin, by clipping; negative where it passes by. Liang, Barsky (1984)."""
    low, high = 0.0, 1.0
    for p, d, edge in ((start[0], end[0] - start[0], cell[1]), (start[1], end[1] - start[1], cell[0])):
        if abs(d) < 1e-12:
            if not edge - margin <= p <= edge + 1 + margin:
                return -1.0
            continue
        a, b = (edge - margin - p) / d, (edge + 1 + margin - p) / d
        low, high = max(low, min(a, b)), min(high, max(a, b))
    return high - low


points = st.tuples(st.floats(0.0, SIZE - 0.01), st.floats(0.0, SIZE - 0.01)).map(np.array)


@given(points, points)
def test_a_ray_crosses_exactly_the_cells_that_it_runs_through(start: FloatArray, end: FloatArray) -> None:
    crossed = {divmod(int(flat), SIZE) for flat in Cells().miss(start[None], end[None])}
    last = (int(end[1]), int(end[0]))
    through = {cell for cell in np.ndindex(SIZE, SIZE) if overlap(start, end, cell, -1e-6) > 0.0}
    assert through - {last} <= crossed
    assert all(overlap(start, end, cell, 1e-6) >= 0.0 for cell in crossed)


@given(st.lists(points, min_size=1, max_size=6), points)
def test_no_cell_is_reported_twice_in_a_scan(ends: list[FloatArray], start: FloatArray) -> None:
    cells = Cells()
    hits, stops = cells.hit(*(tuple(end) for end in ends))
    changed = [*hits, *cells.miss(np.tile(start, (len(ends), 1)), stops)]
    assert len(changed) == len(set(changed))
    assert set(changed) == set(np.flatnonzero(cells.touched))
    insertion.clear(cells.touched, np.array(changed, np.int64))
    assert not cells.touched.any()


def test_the_columns_of_a_surface_are_those_that_the_tests_write() -> None:
    assert (X, Y, NORMAL_X, FLATNESS) == (0, 1, 2, 4)
