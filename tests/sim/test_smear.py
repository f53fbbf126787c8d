"""How far a turning robot smears its scans, before and after deskewing."""

import math

import pytest

from scripts.bench.realism import smears


def test_a_sweep_at_one_radian_a_second_is_smeared_by_its_duration_and_deskewed():
    before, after = smears(2.6)
    assert math.degrees(before) == pytest.approx(3.8, abs=0.3)
    assert abs(math.degrees(after)) <= 0.2
