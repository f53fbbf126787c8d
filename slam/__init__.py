"""Estimation for a planar robot with a lidar: poses, matching, mapping, evaluation. Usable alone: imports nothing of the project's other packages."""
