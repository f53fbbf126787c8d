"""How far estimates are from the truth: trajectories, relations, maps."""
