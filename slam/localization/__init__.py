"""The answers to where the robot is in a map that is known."""
