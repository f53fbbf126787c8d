"""How the robot has moved by its own sensors, between the scans."""
