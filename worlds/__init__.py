"""Worlds the robot can drive in: measured ones as TOML files, generated ones as parameters. No project package is needed to read one."""
