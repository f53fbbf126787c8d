"""The PyBullet twin: the HAL's `Robot` with simulated physics and devices, and the door to the truth."""
