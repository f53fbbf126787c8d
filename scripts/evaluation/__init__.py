"""The parts of `twin evaluate`."""
