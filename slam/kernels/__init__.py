"""Compiled kernels: arrays in, arrays out, no project types."""
