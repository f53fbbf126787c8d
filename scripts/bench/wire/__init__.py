"""The drivers of the real robot over the emulators' own bytes: clients that are killed, clocks, faults, endurance, and SLAM.

Each part is measured alone, and all together take about 80 minutes, in the time of the world.
"""

SMOKE = 5.0
"""So long each lasts when its figures mean nothing [s]."""
