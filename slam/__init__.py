"""Estimation for a planar robot: poses, matching, mapping, evaluation. Usable alone: imports nothing of ours."""
