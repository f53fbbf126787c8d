import numpy as np

from sim.envs import area_kernel


def test_what_a_place_would_show_is_what_is_visible_from_it_and_unseen():
    random = np.random.default_rng(0)
    blocked = (random.uniform(size=(40, 50)) < 0.1).astype(np.uint8)
    unseen, places = random.uniform(size=blocked.shape) < 0.5, random.integers((0, 0), blocked.shape, (6, 2))
    counts = area_kernel.unseen_in_view(blocked, unseen, places, 12.0, 90)
    for place, count in zip(places, counts, strict=True):
        assert count == area_kernel.visible(blocked, place[None], 12.0, 90)[unseen].sum()
