"""Recordings, one file per format; `hardware.logs.registry` lists them."""
