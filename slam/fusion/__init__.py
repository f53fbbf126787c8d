"""One estimator over wheels, gyro, scans, markers and visual odometry."""
