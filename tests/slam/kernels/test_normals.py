import numpy as np
from scipy.stats import kstest

from slam.kernels.normals import standard_normals


def bits(count, seed=0):
    return np.random.default_rng(seed).integers(0, 2**64 - 1, count, np.uint64, endpoint=True)


def test_the_numbers_are_normally_distributed():
    normals = standard_normals(bits(1_000_000)).astype(np.float64)
    assert abs(normals.mean()) < 4.0 / np.sqrt(len(normals))
    assert abs(normals.var() - 1.0) < 4.0 * np.sqrt(2.0 / len(normals))
    assert kstest(normals[::20], "norm").pvalue > 1e-3


def test_the_two_numbers_of_a_pair_are_independent():
    first, second = standard_normals(bits(1_000_000, 1)).astype(np.float64).reshape(2, -1)
    assert abs(np.mean(first * second)) < 4.0 / np.sqrt(len(first))
    assert abs(np.mean((first**2 - 1.0) * (second**2 - 1.0))) < 8.0 / np.sqrt(len(first))


def test_any_bits_make_finite_numbers():
    extreme = np.array([0, 2**64 - 1, 2**41 - 1, 2**24, 2**63], np.uint64)
    normals = standard_normals(extreme)
    assert np.isfinite(normals).all()
    assert np.abs(normals).max() < 5.8


def test_how_many_are_made_at_once_does_not_matter():
    some = bits(1500)
    many, few = standard_normals(some).reshape(2, -1), standard_normals(some[:700]).reshape(2, -1)
    assert np.array_equal(many[:, :700], few)
