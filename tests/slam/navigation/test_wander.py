import numpy as np

from slam.navigation.wander import Wander
from slam.se2 import SE2

NO_ROUTE = np.empty((0, 2))


def test_it_gets_about_and_touches_nothing(rooms, cell_world) -> None:
    world = cell_world(rooms, SE2(1.0, 1.0, 0.3))
    world.run(Wander().build(NO_ROUTE), 60.0)
    assert np.ptp(np.array(world.path)[:, :2], axis=0).max() > 1.5
    assert world.closest > 0.13


def test_another_seed_goes_another_way(rooms, cell_world) -> None:
    worlds = [cell_world(rooms, SE2(1.0, 1.0, 0.3)) for _ in range(3)]
    for world, seed in zip(worlds, (0, 0, 1), strict=True):
        world.run(Wander(seed=seed).build(NO_ROUTE), 20.0)
    assert worlds[0].pose == worlds[1].pose != worlds[2].pose
