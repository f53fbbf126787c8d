"""The hardware abstraction layer, and everything real: recordings, drivers, protocols."""
