import numpy as np
import pytest

from slam.errors import ParameterError
from slam.localization.particles import Particles
from slam.localization.resampling import Kld, parents, quantile_of


def test_the_number_of_particles_is_that_of_foxs_equation_14():
    """k - 1 = 99 degrees of freedom: the chi-square quantile of 99 % is 134.64, over 2 epsilon."""
    assert Kld(10, 100_000, 0.05, 2.3263).needed(100) == pytest.approx(134.64 / 0.1, rel=0.002)


def test_the_number_of_particles_stays_between_its_limits():
    sizes = Kld(300, 900)
    assert sizes.needed(1) == sizes.needed(3) == 300
    assert sizes.needed(5000) == 900


def test_a_belief_in_one_place_needs_few_particles_and_one_everywhere_needs_many():
    rng = np.random.default_rng(1)
    sizes = Kld(100, 3000)
    narrow = Particles.equal(rng.normal(0.2, 0.01, (2000, 3)))
    wide = Particles.equal(rng.uniform(-9.0, 9.0, (2000, 3)))
    assert len(sizes.draw(narrow, rng)) == 100
    assert len(sizes.draw(wide, rng)) == 3000


def test_bins_that_nobody_survives_in_do_not_count():
    rng = np.random.default_rng(1)
    poses = np.concatenate([rng.normal(0.2, 0.01, (1000, 3)), rng.uniform(-9.0, 9.0, (1000, 3))])
    weighed = Particles(poses, np.where(np.arange(2000) < 1000, 0.0, -50.0))
    assert len(Kld(100, 3000).draw(weighed, rng)) == 100


def test_survivors_are_drawn_by_their_weights():
    rng = np.random.default_rng(4)
    assert (np.bincount(parents(np.array([0.5, 0.25, 0.25]), 8, rng)) == [4, 2, 2]).all()


def test_the_quantile_of_99_percent_is_2_33():
    assert quantile_of(0.99) == pytest.approx(2.326, abs=1e-3)


def test_fewer_at_most_than_at_least_is_refused():
    with pytest.raises(ParameterError, match="particles_max = 10; must be at least particles_min, 500"):
        Kld(500, 10)
