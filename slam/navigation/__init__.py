"""From a map and a pose to motion."""
