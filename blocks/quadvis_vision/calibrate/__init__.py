"""From photographs to calibration files: the mathematics of tools/calibrate and tools/calibrate_colours."""
