"""What runs on the brick itself."""
