"""Worlds the robot can drive in: measured ones as TOML files, generated ones as parameters, maps of ROS."""
