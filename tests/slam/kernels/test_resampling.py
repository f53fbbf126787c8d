import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from slam.kernels.resampling import systematic


@given(
    st.lists(st.floats(0.0, 1.0), min_size=1, max_size=40).filter(lambda w: sum(w) > 1e-6),
    st.floats(0.0, 1.0, exclude_max=True),
    st.integers(1, 60),
)
def test_every_particle_survives_as_often_as_its_weight_says_to_within_one(weights, offset, count):
    parents = systematic(np.array(weights), offset, count)
    survived = np.bincount(parents, minlength=len(weights))
    assert len(parents) == count
    assert (np.diff(parents) >= 0).all()
    assert (np.abs(survived - count * np.array(weights) / sum(weights)) < 1.0 + 1e-6).all()


def test_a_particle_without_weight_does_not_survive():
    for offset in (0.0, 0.5, 0.999):
        assert set(systematic(np.array([0.0, 1.0, 0.0, 1.0, 0.0]), offset, 100)) == {1, 3}
