"""Real devices: each with its one thread; vendors' libraries are imported when a device is opened."""
