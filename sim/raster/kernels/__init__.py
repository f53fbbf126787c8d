"""The renderer's Numba kernels: arrays in, arrays out."""
